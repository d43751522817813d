// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/covisible_images.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace veduta {
namespace {

std::vector<ImageId> Rank(const CityMap& map, const MapImage& view, size_t count_max,
                          std::span<const ImageId> among) {
  std::unordered_map<ImageId, uint32_t> shared;
  for (const PointId id : view.points) {
    const PointRecord* point = id.valid() ? map.FindPoint(id) : nullptr;
    if (point == nullptr) continue;
    for (const TrackElement& element : point->track) {
      if (element.image != view.id) ++shared[element.image];
    }
  }
  std::vector<std::pair<ImageId, uint32_t>> ranked;
  ranked.reserve(shared.size());
  for (const auto& [id, count] : shared) {
    if (among.empty() || std::ranges::binary_search(among, id)) ranked.emplace_back(id, count);
  }
  const size_t count = std::min(ranked.size(), count_max);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<ptrdiff_t>(count), ranked.end(),
                    [](const auto& a, const auto& b) {
                      return a.second != b.second ? a.second > b.second : a.first < b.first;
                    });
  std::vector<ImageId> images;
  for (size_t i = 0; i < count; ++i) images.push_back(ranked[i].first);
  return images;
}

}  // namespace

std::vector<ImageId> CovisibleImages(const CityMap& map, ImageId image, size_t count_max) {
  return Rank(map, map.image(image), count_max, {});
}

std::vector<ImageId> CovisibleImages(const CityMap& map, const MapImage& view, size_t count_max) {
  return Rank(map, view, count_max, {});
}

std::vector<ImageId> CovisibleImages(const CityMap& map, ImageId image, size_t count_max,
                                     std::span<const ImageId> among) {
  return Rank(map, map.image(image), count_max, among);
}

}  // namespace veduta
