// SPDX-License-Identifier: Apache-2.0
// Goal: every instruction set finds the same centre and the same score as plain arithmetic, and
//   sums the same clusters.
// Method: a direct |d - c|^2 in 64 bits as reference; random bytes, the extremes 0 and 255
//   where a saturating or 16-bit product would show, all center counts from 1 to 64, and ties.
#include "index/center_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/cpu_isa.h"

namespace veduta {
namespace {

struct NamedKernels {
  const char* name;
  const CenterKernels* kernels;
};

std::vector<NamedKernels> AllKernels() {
  std::vector<NamedKernels> all;
  for (const CpuIsa isa : kCpuIsas) {
    const CenterKernels* kernels = FindCenterKernels(isa);
    if (kernels != nullptr) all.push_back({CpuIsaName(isa), kernels});
  }
  return all;
}

std::vector<uint8_t> RandomRows(size_t n, uint64_t seed, bool extreme) {
  SeededRandom random(seed);
  std::vector<uint8_t> rows(n * kCenterSize);
  for (uint8_t& byte : rows)
    byte = static_cast<uint8_t>(extreme ? random.Below(2) * 255 : random.Below(256));
  return rows;
}

int64_t SquaredDistance(const uint8_t* a, const uint8_t* b) {
  int64_t sum = 0;
  for (int j = 0; j < kCenterSize; ++j) sum += (int64_t{a[j]} - b[j]) * (int64_t{a[j]} - b[j]);
  return sum;
}

void ExpectNearest(const std::vector<uint8_t>& descriptors, const std::vector<uint8_t>& centers) {
  const size_t n = descriptors.size() / kCenterSize;
  const uint32_t count = static_cast<uint32_t>(centers.size() / kCenterSize);
  std::vector<int32_t> biases;
  for (uint32_t c = 0; c < count; ++c) biases.push_back(CenterBias(&centers[c * kCenterSize]));
  for (const auto& [name, kernels] : AllKernels()) {
    std::vector<uint8_t> nearest(n);
    std::vector<int32_t> scores(n);
    kernels->nearest_each(descriptors.data(), n, centers.data(), biases.data(), count,
                          nearest.data(), scores.data());
    for (size_t i = 0; i < n; ++i) {
      const uint8_t* descriptor = &descriptors[i * kCenterSize];
      uint32_t best = 0;
      for (uint32_t c = 1; c < count; ++c) {
        if (SquaredDistance(descriptor, &centers[c * kCenterSize]) <
            SquaredDistance(descriptor, &centers[best * kCenterSize])) {
          best = c;
        }
      }
      ASSERT_EQ(nearest[i], best) << name << ", descriptor " << i << " of " << count << " centers";
      ASSERT_EQ(scores[i] + DescriptorNorm(descriptor),
                SquaredDistance(descriptor, &centers[best * kCenterSize]))
          << name;
      int32_t score = 0;
      ASSERT_EQ(kernels->nearest(descriptor, centers.data(), biases.data(), count, &score), best)
          << name;
      ASSERT_EQ(score, scores[i]) << name;
    }
  }
}

TEST(CenterKernels, AgreeWithPlainArithmetic) {
  for (uint32_t count = 1; count <= kCenterCountMax; ++count) {
    for (const bool extreme : {false, true}) {
      ExpectNearest(RandomRows(9, MixSeed(count, 1), extreme),
                    RandomRows(count, MixSeed(count, 2), extreme));
    }
  }
}

TEST(CenterKernels, ExtremesDoNotOverflow) {
  for (const uint8_t d : {0, 255}) {
    for (const uint8_t c : {0, 255}) {
      ExpectNearest(std::vector<uint8_t>(kCenterSize, d), std::vector<uint8_t>(kCenterSize, c));
    }
  }
}

TEST(CenterKernels, TiesGoToTheFirst) {
  const std::vector<uint8_t> descriptors = RandomRows(4, 5, false);
  for (uint32_t count = 2; count <= kCenterCountMax; ++count) {
    // The nearest center stands twice, in lanes and groups of every combination.
    for (uint32_t first = 0; first + 1 < count; first += 3) {
      for (uint32_t second = first + 1; second < count; second += 2) {
        std::vector<uint8_t> centers = RandomRows(count, count, true);
        std::copy_n(descriptors.begin(), kCenterSize, centers.begin() + first * kCenterSize);
        std::copy_n(descriptors.begin(), kCenterSize, centers.begin() + second * kCenterSize);
        std::vector<int32_t> biases;
        for (uint32_t c = 0; c < count; ++c)
          biases.push_back(CenterBias(&centers[c * kCenterSize]));
        for (const auto& [name, kernels] : AllKernels()) {
          int32_t score = 0;
          ASSERT_EQ(
              kernels->nearest(descriptors.data(), centers.data(), biases.data(), count, &score),
              first)
              << name << ", also at " << second << " of " << count;
        }
      }
    }
  }
}

TEST(CenterKernels, AccumulateSumsEachCluster) {
  const size_t n = 1000;
  const uint32_t count = 7;
  const std::vector<uint8_t> descriptors = RandomRows(n, 9, false);
  SeededRandom random(10);
  std::vector<uint8_t> nearest(n);
  for (uint8_t& c : nearest) c = static_cast<uint8_t>(random.Below(count));
  std::vector<uint32_t> expected(count * kCenterSize, 3);  // sums are added to what is there
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < kCenterSize; ++j)
      expected[nearest[i] * kCenterSize + j] += descriptors[i * kCenterSize + j];
  }
  for (const auto& [name, kernels] : AllKernels()) {
    std::vector<uint32_t> sums(count * kCenterSize, 3);
    kernels->accumulate(descriptors.data(), n, nearest.data(), sums.data());
    EXPECT_EQ(sums, expected) << name;
  }
}

}  // namespace
}  // namespace veduta
