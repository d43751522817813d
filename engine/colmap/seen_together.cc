// SPDX-License-Identifier: Apache-2.0
#include "engine/colmap/seen_together.h"

#include <algorithm>
#include <utility>

namespace veduta {
namespace {

// Of one point: what many images see, those see together that see less as well. Chosen by hand.
constexpr size_t kImagesOfPointMax = 32;
// Pairs that are counted, some 1 GB of memory at most; later ones are left to retrieval. Chosen by
// hand.
constexpr size_t kPairsMax = 20'000'000;

}  // namespace

void SeenTogether::AddPoint(std::span<const uint32_t> images) {
  const auto some = images.first(std::min(images.size(), kImagesOfPointMax));
  for (size_t i = 0; i < some.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const auto [earlier, later] = std::minmax(some[i], some[j]);
      const uint64_t pair = uint64_t{later} << 32 | earlier;
      const auto known = counts_.find(pair);
      if (known != counts_.end()) {
        ++known->second;
      } else if (counts_.size() < kPairsMax) {
        counts_.emplace(pair, 1);
      }
    }
  }
}

std::vector<std::vector<uint32_t>> SeenTogether::EarlierPartners(size_t image_count,
                                                                 size_t count_max) const {
  std::vector<std::vector<std::pair<uint32_t, uint32_t>>> counted(image_count);
  for (const auto& [pair, count] : counts_)
    counted[pair >> 32].emplace_back(count, static_cast<uint32_t>(pair));
  std::vector<std::vector<uint32_t>> partners(image_count);
  for (size_t i = 0; i < image_count; ++i) {
    std::ranges::sort(counted[i], [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    if (counted[i].size() > count_max) counted[i].resize(count_max);
    for (const auto& [count, earlier] : counted[i]) partners[i].push_back(earlier);
  }
  return partners;
}

}  // namespace veduta
