// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which images of a model see the same points.

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace veduta {

class SeenTogether final {
 public:
  // The images, by their places, that see one point; each once. O(k^2) for k of them, of which the
  // first 32 are counted.
  void AddPoint(std::span<const uint32_t> images);
  // For each of `image_count` images up to `count_max` earlier ones that share most points with it,
  // the most first, then in ascending places.
  std::vector<std::vector<uint32_t>> EarlierPartners(size_t image_count, size_t count_max) const;

 private:
  std::unordered_map<uint64_t, uint32_t> counts_;  // of points, by later << 32 | earlier
};

}  // namespace veduta
