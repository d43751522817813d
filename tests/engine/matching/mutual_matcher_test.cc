// SPDX-License-Identifier: Apache-2.0
// Goal: mutual matching is exact, and the same bit for bit on every instruction set this
//   machine has.
// Method: seeded random bytes against two plain loops; counts straddle the edges of panels,
//   tiles and blocks, bytes reach the extremes, and few distinct descriptors force ties
//   everywhere.
#include "engine/matching/mutual_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/matching/matcher_kernels.h"
#include "storage/base/content_hash.h"
#include "storage/base/cpu_isa.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

std::vector<CpuIsa> Isas() {
  std::vector<CpuIsa> isas;
  for (const CpuIsa isa : kCpuIsas) {
    if (FindMatcherKernels(isa) != nullptr) isas.push_back(isa);
  }
  return isas;
}

enum class Bytes { kAny, kExtreme, kFewValues, kRootSift };
enum class Signs { kOne, kMixed };

uint8_t RandomByte(Bytes bytes, SeededRandom* random) {
  switch (bytes) {
    case Bytes::kAny:
      return static_cast<uint8_t>(random->Below(256));
    case Bytes::kExtreme:
      return random->Below(2) != 0 ? 255 : 0;
    case Bytes::kFewValues:
      return random->Below(64) == 0 ? 1 : 0;
    case Bytes::kRootSift:
      return static_cast<uint8_t>(random->Below(91));
  }
  return 0;
}

Features RandomFeatures(uint32_t count, Bytes bytes, Signs signs, uint64_t seed) {
  SeededRandom random(seed);
  Features features;
  features.keypoints.resize(count);
  features.descriptors.resize(count * static_cast<size_t>(kDescriptorSize));
  for (Keypoint& keypoint : features.keypoints) {
    keypoint.contrast_sign = signs == Signs::kOne
                                 ? int8_t{1}
                                 : static_cast<int8_t>(1 - 2 * static_cast<int>(random.Below(2)));
  }
  for (uint8_t& byte : features.descriptors) byte = RandomByte(bytes, &random);
  return features;
}

uint32_t Distance(const Features& a, size_t i, const Features& b, size_t j) {
  uint32_t sum = 0;
  for (int k = 0; k < kDescriptorSize; ++k) {
    const int difference = a.descriptor(i)[k] - b.descriptor(j)[k];
    sum += static_cast<uint32_t>(difference * difference);
  }
  return sum;
}

// What MatchMutual without limits must give for the first `count` features of each.
std::vector<DescriptorMatch> Reference(const Features& a, const Features& b, size_t count) {
  const size_t count_a = std::min(count, a.size());
  const size_t count_b = std::min(count, b.size());
  std::vector<DescriptorMatch> best_of_a(count_a, {0, UINT32_MAX, UINT32_MAX, UINT32_MAX});
  std::vector<std::pair<uint32_t, size_t>> best_of_b(count_b, {UINT32_MAX, SIZE_MAX});
  for (size_t i = 0; i < count_a; ++i) {
    DescriptorMatch& best = best_of_a[i];
    best.a = static_cast<FeatureIndex>(i);
    for (size_t j = 0; j < count_b; ++j) {
      if (a.keypoints[i].contrast_sign != b.keypoints[j].contrast_sign) continue;
      const uint32_t distance = Distance(a, i, b, j);
      if (distance < best.distance_squared) {
        best.second_distance_squared = best.distance_squared;
        best.distance_squared = distance;
        best.b = static_cast<FeatureIndex>(j);
      } else {
        best.second_distance_squared = std::min(best.second_distance_squared, distance);
      }
      if (distance < best_of_b[j].first) best_of_b[j] = {distance, i};
    }
  }
  std::erase_if(best_of_a, [&](const DescriptorMatch& match) {
    return match.b == UINT32_MAX || best_of_b[match.b].second != match.a;
  });
  return best_of_a;
}

void ExpectExact(const Features& a, const Features& b, uint32_t count) {
  const std::vector<DescriptorMatch> expected = Reference(a, b, count);
  const std::vector<DescriptorMatch> expected_back = Reference(b, a, count);
  const auto packed_a = PackedDescriptors::Pack(a, count);
  const auto packed_b = PackedDescriptors::Pack(b, count);
  ASSERT_TRUE(packed_a.ok() && packed_b.ok());
  for (const CpuIsa isa : Isas()) {
    const CpuIsaLimit limit(isa);
    MatchOptions options;
    const std::vector<DescriptorMatch> matches = MatchMutual(*packed_a, *packed_b, options);
    EXPECT_EQ(matches, expected) << CpuIsaName(isa) << ": " << a.size() << " x " << b.size();
    const MatchesBothWays both = MatchBothWays(*packed_a, *packed_b, options);
    EXPECT_EQ(both.from_a, expected) << CpuIsaName(isa) << ": " << a.size() << " x " << b.size();
    EXPECT_EQ(both.from_b, expected_back)
        << CpuIsaName(isa) << ": " << a.size() << " x " << b.size();
  }
}

TEST(MutualMatcher, EqualsLoopsAtEveryEdge) {
  const std::vector<uint32_t> counts = {0,  1,  2,  7,  8,  9,  15,  16,  17,
                                        31, 32, 33, 63, 64, 65, 255, 256, 257};
  uint64_t seed = 1;
  for (const uint32_t count_a : counts) {
    for (const uint32_t count_b : counts) {
      const Bytes bytes = static_cast<Bytes>(seed % 4);
      const Signs signs = seed % 3 == 0 ? Signs::kOne : Signs::kMixed;
      const Features a = RandomFeatures(count_a, bytes, signs, MixSeed(seed, 1));
      const Features b = RandomFeatures(count_b, bytes, signs, MixSeed(seed, 2));
      ExpectExact(a, b, 1500);
      ++seed;
    }
  }
}

TEST(MutualMatcher, EqualsLoopsAtFullSize) {
  for (const Bytes bytes : {Bytes::kAny, Bytes::kExtreme, Bytes::kFewValues}) {
    const Signs signs = bytes == Bytes::kAny ? Signs::kOne : Signs::kMixed;
    const Features a = RandomFeatures(1600, bytes, signs, 11);
    const Features b = RandomFeatures(1500, bytes, signs, 12);
    ExpectExact(a, b, 1500);
  }
}

// A row's key names 2048 or 4096 columns, a column's 256 rows: more of either are joined block by
// block.
TEST(MutualMatcher, JoinsBlocksOfColumnsAndRows) {
  for (const Bytes bytes : {Bytes::kRootSift, Bytes::kFewValues}) {
    const Features narrow = RandomFeatures(40, bytes, Signs::kOne, 21);
    const Features wide = RandomFeatures(8300, bytes, Signs::kOne, 22);
    ExpectExact(narrow, wide, kPackedCountMax);
    ExpectExact(wide, narrow, kPackedCountMax);
  }
}

TEST(MutualMatcher, ExtremeDistancesDoNotOverflow) {
  // All of a white, all of b black: every distance is 128 * 255^2, every tie goes to 0.
  Features a = RandomFeatures(70, Bytes::kAny, Signs::kOne, 31);
  Features b = a;
  std::fill(a.descriptors.begin(), a.descriptors.end(), uint8_t{255});
  std::fill(b.descriptors.begin(), b.descriptors.end(), uint8_t{0});
  const auto packed_a = PackedDescriptors::Pack(a, 1500);
  const auto packed_b = PackedDescriptors::Pack(b, 1500);
  ASSERT_TRUE(packed_a.ok() && packed_b.ok());
  for (const CpuIsa isa : Isas()) {
    const CpuIsaLimit limit(isa);
    MatchOptions options;
    const std::vector<DescriptorMatch> expected = {{0, 0, 128 * 255 * 255, 128 * 255 * 255}};
    EXPECT_EQ(MatchMutual(*packed_a, *packed_b, options), expected) << CpuIsaName(isa);
    EXPECT_EQ(MatchMutual(*packed_b, *packed_a, options), expected) << CpuIsaName(isa);
  }
  ExpectExact(a, a, 1500);
  ExpectExact(b, b, 1500);
}

TEST(MutualMatcher, TiesGoToTheLowestIndexAcrossBlocks) {
  Features a = RandomFeatures(600, Bytes::kAny, Signs::kOne, 41);
  Features b = RandomFeatures(5000, Bytes::kAny, Signs::kOne, 42);
  const auto copy = [](const Features& from, size_t i, Features* to, size_t j) {
    std::copy_n(from.descriptor(i), kDescriptorSize,
                to->descriptors.begin() + static_cast<ptrdiff_t>(j * kDescriptorSize));
  };
  for (const size_t i : {size_t{300}, size_t{599}})
    copy(a, 7, &a, i);  // equals in other blocks of rows
  for (const size_t j : {size_t{33}, size_t{40}, size_t{2100}, size_t{4999}}) copy(a, 7, &b, j);
  const auto packed_a = PackedDescriptors::Pack(a, 600);
  const auto packed_b = PackedDescriptors::Pack(b, 5000);
  ASSERT_TRUE(packed_a.ok() && packed_b.ok());
  for (const CpuIsa isa : Isas()) {
    const CpuIsaLimit limit(isa);
    MatchOptions options;
    options.distance_squared_max = 0;
    const std::vector<DescriptorMatch> expected = {{7, 33, 0, 0}};
    EXPECT_EQ(MatchMutual(*packed_a, *packed_b, options), expected) << CpuIsaName(isa);
  }
}

TEST(MutualMatcher, ContrastSignsStayApart) {
  Features a = RandomFeatures(3, Bytes::kAny, Signs::kOne, 51);
  Features b = a;  // every descriptor has its twin
  a.keypoints[0].contrast_sign = -1;
  a.keypoints[1].contrast_sign = 0;
  b.keypoints[0].contrast_sign = 1;  // the twin of a's 0 has the other sign
  b.keypoints[1].contrast_sign = 0;
  b.keypoints[2].contrast_sign = 1;
  const auto packed_a = PackedDescriptors::Pack(a, 3);
  const auto packed_b = PackedDescriptors::Pack(b, 3);
  ASSERT_TRUE(packed_a.ok() && packed_b.ok());
  for (const CpuIsa isa : Isas()) {
    const CpuIsaLimit limit(isa);
    MatchOptions options;
    const std::vector<DescriptorMatch> matches = MatchMutual(*packed_a, *packed_b, options);
    ASSERT_EQ(matches.size(), 2u);
    EXPECT_EQ(matches[0],
              (DescriptorMatch{1, 1, 0, UINT32_MAX}));  // the only ones without a sign: no second
    EXPECT_EQ(matches[1], (DescriptorMatch{2, 2, 0, Distance(a, 2, b, 0)}));
  }
}

TEST(MutualMatcher, LimitsFilterMutualMatches) {
  const Features a = RandomFeatures(300, Bytes::kRootSift, Signs::kMixed, 61);
  Features b = RandomFeatures(300, Bytes::kRootSift, Signs::kMixed, 62);
  for (size_t i = 0; i < 100; ++i) {  // a hundred true matches, a little noisy
    b.keypoints[i] = a.keypoints[i];
    for (int k = 0; k < kDescriptorSize; ++k) {
      b.descriptors[i * kDescriptorSize + k] =
          static_cast<uint8_t>(a.descriptor(i)[k] + (k * 7 + static_cast<int>(i)) % 9);
    }
  }
  const auto packed_a = PackedDescriptors::Pack(a, 300);
  const auto packed_b = PackedDescriptors::Pack(b, 300);
  ASSERT_TRUE(packed_a.ok() && packed_b.ok());
  const std::vector<DescriptorMatch> all = Reference(a, b, 300);
  MatchOptions options;
  options.ratio_max = 0.5;
  options.distance_squared_max = 3000;
  std::vector<DescriptorMatch> expected;
  for (const DescriptorMatch& match : all) {
    if (match.distance_squared <= 3000 &&
        4ull * match.distance_squared <= match.second_distance_squared) {
      expected.push_back(match);
    }
  }
  EXPECT_GT(expected.size(), 50u);
  EXPECT_LT(expected.size(), all.size());
  EXPECT_EQ(MatchMutual(*packed_a, *packed_b, options), expected);
  EXPECT_EQ(MatchBothWays(*packed_a, *packed_b, options).from_a, expected);
  EXPECT_EQ(MatchBothWays(*packed_b, *packed_a, options).from_b, expected);
}

TEST(MutualMatcher, EveryBoundOfItsOptionsIsNoticed) {
  using Options = MatchOptions;
  ExpectBounds<Options, double>(&Options::ratio_max, "ratio_max", {-1, 0, 1.1, NAN}, {0.1, 1});
  ExpectBounds<Options, uint32_t>(&Options::distance_squared_max, "distance_squared_max", {},
                                  {0, UINT32_MAX});
}

TEST(PackedDescriptors, TakesTheStrongestAndRefusesWhatDoesNotFit) {
  Features features = RandomFeatures(100, Bytes::kAny, Signs::kMixed, 71);
  const auto packed = PackedDescriptors::Pack(features, 60);
  ASSERT_TRUE(packed.ok());
  EXPECT_EQ(packed->count(), 60u);
  EXPECT_LT(packed->size_bytes(), 60 * 140 + 2 * sizeof(DescriptorPanel) + 256);
  EXPECT_EQ(PackedDescriptors::Pack(features, kPackedCountMax + 1).status().code(),
            StatusCode::kInvalidArgument);
  features.descriptors.pop_back();
  EXPECT_EQ(PackedDescriptors::Pack(features, 60).status().code(), StatusCode::kInvalidArgument);
}

TEST(DescriptorDistances, EqualLoopsOnEveryIsa) {
  for (const Bytes bytes : {Bytes::kAny, Bytes::kExtreme}) {
    const Features features = RandomFeatures(500, bytes, Signs::kOne, 81);
    std::vector<uint32_t> indices;
    SeededRandom random(82);
    for (int i = 0; i < 300; ++i) indices.push_back(random.Below(500));
    for (const CpuIsa isa : Isas()) {
      std::vector<uint32_t> distances(indices.size());
      FindMatcherKernels(isa)->distances(features.descriptor(3), features.descriptors.data(),
                                         indices.data(), indices.size(), distances.data());
      for (size_t i = 0; i < indices.size(); ++i) {
        ASSERT_EQ(distances[i], Distance(features, 3, features, indices[i])) << CpuIsaName(isa);
      }
    }
  }
}

}  // namespace
}  // namespace veduta
