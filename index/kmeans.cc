// SPDX-License-Identifier: Apache-2.0
#include "index/kmeans.h"

#include <algorithm>
#include <cstring>

#include "index/center_kernels.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr size_t kChunk = 8192;  // descriptors in one piece of parallel work: 1 MB; chosen by hand

size_t ChunkCount(size_t n) {
  return (n + kChunk - 1) / kChunk;
}
size_t ChunkSize(size_t n, size_t chunk) {
  return std::min(kChunk, n - chunk * kChunk);
}

// Uniform in [0, bound); the bias of the multiply-shift is below bound / 2^64.
uint64_t Below(SeededRandom& random, uint64_t bound) {
  return static_cast<uint64_t>((static_cast<unsigned __int128>(random.Next()) * bound) >> 64);
}

void AppendCenter(KMeansCenters* centers, const uint8_t* row) {
  centers->rows.insert(centers->rows.end(), row, row + kCenterSize);
  centers->biases.push_back(CenterBias(row));
  ++centers->count;
}

// One problem: its descriptors, their norms, and room for what each round computes.
class Lloyd final {
 public:
  Lloyd(std::span<const uint8_t> descriptors, ThreadPool& pool)
      : descriptors_(descriptors.data()), n_(descriptors.size() / kCenterSize), pool_(pool) {
    norms_.resize(n_);
    nearest_.resize(n_);
    pool_.ParallelFor(ChunkCount(n_), [&](size_t chunk) {
      const size_t begin = chunk * kChunk;
      for (size_t i = begin; i < begin + ChunkSize(n_, chunk); ++i)
        norms_[i] = DescriptorNorm(Row(i));
    });
  }

  // k-means++: each next centre is a descriptor drawn with probability proportional to its squared
  // distance to the nearest centre so far. Ends early when every descriptor is a centre.
  KMeansCenters ChooseStart(uint32_t count_max, uint64_t seed) {
    SeededRandom random(seed);
    KMeansCenters centers;
    AppendCenter(&centers, Row(static_cast<size_t>(Below(random, n_))));
    std::vector<int32_t> distances(n_, INT32_MAX);
    while (centers.count < count_max) {
      const uint64_t total = UpdateDistances(centers, &distances);
      if (total == 0) break;
      const uint64_t drawn = Below(random, total);
      uint64_t passed = 0;
      size_t i = 0;
      while ((passed += static_cast<uint64_t>(distances[i])) <= drawn) ++i;
      AppendCenter(&centers, Row(i));
    }
    return centers;
  }

  // Nearest centres of all descriptors and the distortion; with `sums`, also each cluster's sum and
  // size.
  uint64_t Assign(const KMeansCenters& centers, std::vector<uint64_t>* sums,
                  std::vector<uint64_t>* sizes) {
    const size_t chunk_count = ChunkCount(n_);
    std::vector<uint64_t> distortions(chunk_count, 0);
    std::vector<std::vector<uint32_t>> chunk_sums(chunk_count);
    pool_.ParallelFor(chunk_count, [&](size_t chunk) {
      const size_t begin = chunk * kChunk, size = ChunkSize(n_, chunk);
      std::vector<int32_t> scores(size);
      kernels_.nearest_each(Row(begin), size, centers.rows.data(), centers.biases.data(),
                            centers.count, nearest_.data() + begin, scores.data());
      for (size_t i = 0; i < size; ++i)
        distortions[chunk] += static_cast<uint64_t>(scores[i] + norms_[begin + i]);
      if (sums == nullptr) return;
      chunk_sums[chunk].assign(static_cast<size_t>(centers.count) * kCenterSize, 0);
      kernels_.accumulate(Row(begin), size, nearest_.data() + begin, chunk_sums[chunk].data());
    });
    uint64_t distortion = 0;
    for (const uint64_t part : distortions) distortion += part;
    if (sums == nullptr) return distortion;
    sums->assign(static_cast<size_t>(centers.count) * kCenterSize, 0);
    for (const std::vector<uint32_t>& part : chunk_sums) {
      for (size_t j = 0; j < part.size(); ++j) (*sums)[j] += part[j];
    }
    sizes->assign(centers.count, 0);
    for (const uint8_t c : nearest_) ++(*sizes)[c];
    return distortion;
  }

 private:
  const uint8_t* Row(size_t i) const { return descriptors_ + i * kCenterSize; }

  // Takes the last centre into account; returns the sum.
  uint64_t UpdateDistances(const KMeansCenters& centers, std::vector<int32_t>* distances) {
    const uint8_t* row = centers.rows.data() + static_cast<size_t>(centers.count - 1) * kCenterSize;
    std::vector<uint64_t> totals(ChunkCount(n_), 0);
    pool_.ParallelFor(totals.size(), [&](size_t chunk) {
      const size_t begin = chunk * kChunk, size = ChunkSize(n_, chunk);
      std::vector<int32_t> scores(size);
      std::vector<uint8_t> unused(size);
      kernels_.nearest_each(Row(begin), size, row, &centers.biases.back(), 1, unused.data(),
                            scores.data());
      for (size_t i = 0; i < size; ++i) {
        int32_t& distance = (*distances)[begin + i];
        distance = std::min(distance, scores[i] + norms_[begin + i]);
        totals[chunk] += static_cast<uint64_t>(distance);
      }
    });
    uint64_t total = 0;
    for (const uint64_t part : totals) total += part;
    return total;
  }

  const CenterKernels& kernels_ = BestCenterKernels();
  const uint8_t* descriptors_;
  size_t n_;
  ThreadPool& pool_;
  std::vector<int32_t> norms_;
  std::vector<uint8_t> nearest_;
};

// Rounded means; a centre whose cluster is empty, or that fell on an earlier one, is dropped.
KMeansCenters Means(const std::vector<uint64_t>& sums, const std::vector<uint64_t>& sizes) {
  KMeansCenters means;
  for (size_t c = 0; c < sizes.size(); ++c) {
    if (sizes[c] == 0) continue;
    uint8_t row[kCenterSize];
    for (size_t j = 0; j < kCenterSize; ++j) {
      row[j] = static_cast<uint8_t>((2 * sums[c * kCenterSize + j] + sizes[c]) / (2 * sizes[c]));
    }
    bool known = false;
    for (uint32_t m = 0; m < means.count && !known; ++m) {
      known = std::memcmp(means.rows.data() + static_cast<size_t>(m) * kCenterSize, row,
                          kCenterSize) == 0;
    }
    if (!known) AppendCenter(&means, row);
  }
  return means;
}

}  // namespace

void AssignToCenters(std::span<const uint8_t> descriptors, std::span<const uint32_t> rows,
                     const KMeansCenters& centers, std::span<uint8_t> nearest,
                     std::span<uint32_t> distances, ThreadPool& pool) {
  const CenterKernels& kernels = BestCenterKernels();
  pool.ParallelFor(ChunkCount(rows.size()), [&](size_t chunk) {
    const size_t begin = chunk * kChunk;
    for (size_t i = begin; i < begin + ChunkSize(rows.size(), chunk); ++i) {
      const uint8_t* descriptor = descriptors.data() + size_t{rows[i]} * kCenterSize;
      int32_t score;
      nearest[i] = static_cast<uint8_t>(kernels.nearest(
          descriptor, centers.rows.data(), centers.biases.data(), centers.count, &score));
      distances[i] = static_cast<uint32_t>(score + DescriptorNorm(descriptor));
    }
  });
}

KMeansCenters FindCenters(std::span<const uint8_t> descriptors, uint32_t count_max,
                          uint32_t iterations_max, uint64_t seed, ThreadPool& pool) {
  Lloyd lloyd(descriptors, pool);
  KMeansCenters centers = lloyd.ChooseStart(count_max, seed);
  std::vector<uint64_t> sums, sizes;
  for (uint32_t i = 0; i < iterations_max; ++i) {
    centers.distortion = lloyd.Assign(centers, &sums, &sizes);
    KMeansCenters next = Means(sums, sizes);
    if (next.rows == centers.rows) return centers;
    centers = std::move(next);
  }
  centers.distortion = lloyd.Assign(centers, nullptr, nullptr);
  return centers;
}

}  // namespace veduta
