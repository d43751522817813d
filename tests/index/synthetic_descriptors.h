// SPDX-License-Identifier: Apache-2.0
#pragma once
// Descriptors with known neighbours for the tests of index/.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "index/center_kernels.h"
#include "storage/base/content_hash.h"

namespace veduta {

// Sparse like SIFT: most bins are small, a few are large.
inline std::vector<uint8_t> RandomDescriptor(SeededRandom& random) {
  std::vector<uint8_t> descriptor(kCenterSize);
  for (uint8_t& byte : descriptor) {
    const double u = random.Unit();
    byte = static_cast<uint8_t>(160 * u * u * u);
  }
  return descriptor;
}

// The same spot seen again: every bin moves by up to `noise`, uniformly.
inline std::vector<uint8_t> SeenAgain(const uint8_t* descriptor, int noise, SeededRandom& random) {
  std::vector<uint8_t> again(kCenterSize);
  for (int j = 0; j < kCenterSize; ++j) {
    const int moved = descriptor[j] +
                      static_cast<int>(random.Below(static_cast<uint32_t>(2 * noise + 1))) - noise;
    again[j] = static_cast<uint8_t>(std::clamp(moved, 0, 255));
  }
  return again;
}

inline void Append(std::vector<uint8_t>* rows, const std::vector<uint8_t>& descriptor) {
  rows->insert(rows->end(), descriptor.begin(), descriptor.end());
}

inline std::vector<uint8_t> RandomDescriptors(size_t n, uint64_t seed) {
  SeededRandom random(seed);
  std::vector<uint8_t> rows;
  for (size_t i = 0; i < n; ++i) Append(&rows, RandomDescriptor(random));
  return rows;
}

// n descriptors about `cluster_count` centres.
inline std::vector<uint8_t> ClusteredDescriptors(size_t n, size_t cluster_count, int noise,
                                                 uint64_t seed) {
  SeededRandom random(seed);
  const std::vector<uint8_t> clusters = RandomDescriptors(cluster_count, MixSeed(seed, 1));
  std::vector<uint8_t> rows;
  for (size_t i = 0; i < n; ++i) {
    const size_t c = random.Below(static_cast<uint32_t>(cluster_count));
    Append(&rows, SeenAgain(&clusters[c * kCenterSize], noise, random));
  }
  return rows;
}

}  // namespace veduta
