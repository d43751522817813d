// SPDX-License-Identifier: Apache-2.0
#pragma once
// k-means of descriptors (Lloyd 1982, started by k-means++: Arthur and Vassilvitskii 2007), in
// integers.

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/thread_pool.h"

namespace veduta {

struct KMeansCenters {
  std::vector<uint8_t> rows;    // [count x 128] row-major, no two equal
  std::vector<int32_t> biases;  // [count], see center_kernels.h
  uint32_t count = 0;           // fewer than asked for where there are fewer distinct descriptors
  uint64_t distortion = 0;  // sum of squared distances from the descriptors to their nearest centre
};

// For each of the chosen rows of descriptors [n x 128], its nearest centre (ties: the first) and
// the squared distance. nearest and distances: [rows]. Work is spread over the pool; the result
// does not depend on it. Thread-safe.
void AssignToCenters(std::span<const uint8_t> descriptors, std::span<const uint32_t> rows,
                     const KMeansCenters& centers, std::span<uint8_t> nearest,
                     std::span<uint32_t> distances, ThreadPool& pool);

// Centres of `count_max` clusters of descriptors [n x 128], n >= 1; count_max in [1, 64].
//
// A centre is the mean of its cluster rounded to bytes: that costs at most 128/4 of squared
// distance (in practice 128/12, against tens of thousands for SIFT), and makes every distance and
// every sum an exact integer. So the result is the same on any number of threads and on any
// processor. Stops after iterations_max rounds or when no centre moves. O(n * count_max *
// iterations_max) time, O(n) memory. Thread-safe.
KMeansCenters FindCenters(std::span<const uint8_t> descriptors, uint32_t count_max,
                          uint32_t iterations_max, uint64_t seed, ThreadPool& pool);

}  // namespace veduta
