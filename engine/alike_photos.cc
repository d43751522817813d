// SPDX-License-Identifier: Apache-2.0
#include "engine/alike_photos.h"

#include <algorithm>
#include <utility>

#include "engine/camera/undistorter.h"
#include "engine/matching/mutual_matcher.h"
#include "engine/photo/photo_preparer.h"

namespace veduta {
namespace {

constexpr size_t kPhotosMax = 1500;
// Strongest features of a photo that are matched. Two photos with fewer matches than kMatchesMin
// may only show the same windows: of a rendered street such had up to 25, neighbours 30 to 100, and
// of castle-P19 neighbours 40 to 64. More than kMatchesMax say no more: what looks all the same is
// mostly taken from one spot, and tells little of the camera. Chosen by hand.
constexpr uint32_t kFeatures = 160, kMatchesMin = 20, kMatchesMax = 60;
constexpr double kRatioMax = 0.8;
// There is no lens to undo.
constexpr size_t kTableBytes = 1 << 20;

PackedDescriptors FewFeatures(const PhotoPreparer& preparer, const PhotoSource& photo) {
  const PreparedPhoto extracted = preparer.Extract(photo, std::nullopt);
  if (!extracted.failure.ok() || extracted.reason != Reason::kNone) return {};
  Result<PackedDescriptors> packed = PackedDescriptors::Pack(extracted.features, kFeatures);
  return packed.ok() ? *std::move(packed) : PackedDescriptors();
}

uint32_t LikenessOf(size_t matches) {
  if (matches < kMatchesMin) return 0;
  return static_cast<uint32_t>(std::min<size_t>(matches, kMatchesMax)) + 1 - kMatchesMin;
}

}  // namespace

Result<AlikePhotos> AlikePhotos::Look(std::span<const PhotoSource> photos,
                                      const PhotoDecoder& decoder, ThreadPool* pool,
                                      const std::stop_token& stop) {
  const size_t count = std::min(photos.size(), kPhotosMax);
  UndistortCache tables(kTableBytes);
  PrepareOptions options;
  options.features.feature_count_max = kFeatures;
  options.features.upsample = false;
  const PhotoPreparer preparer(nullptr, &tables, options, decoder);
  std::vector<PackedDescriptors> features(count);
  pool->ParallelFor(count, [&](size_t i) {
    if (!stop.stop_requested()) features[i] = FewFeatures(preparer, photos[i]);
  });
  AlikePhotos looked(photos.size());
  pool->ParallelFor(count, [&](size_t i) {
    for (uint32_t j = 0; j < i && !stop.stop_requested(); ++j) {
      const uint32_t likeness =
          LikenessOf(MatchMutual(features[j], features[i], {.ratio_max = kRatioMax}).size());
      if (likeness > 0) looked.alike_[i].push_back({j, likeness});
    }
  });
  for (uint32_t i = 0; i < count; ++i) {
    const size_t before = looked.alike_[i].size();  // what is added has higher numbers
    for (size_t k = 0; k < before && looked.alike_[i][k].photo < i; ++k)
      looked.alike_[looked.alike_[i][k].photo].push_back({i, looked.alike_[i][k].likeness});
  }
  if (stop.stop_requested()) return Status::Cancelled("stopped");
  return looked;
}

std::vector<size_t> AlikePhotos::Choose(std::span<const size_t> among, size_t count_max) const {
  std::vector<bool> is_free(alike_.size());
  for (const size_t photo : among) is_free[photo] = true;
  std::vector<uint64_t> scores(alike_.size());
  for (const size_t photo : among) {
    for (const Alike& other : alike_[photo]) {
      if (is_free[other.photo]) scores[photo] += other.likeness;
    }
  }
  std::vector<size_t> chosen;
  while (chosen.size() < count_max) {
    const size_t* best = nullptr;
    for (const size_t& photo : among) {
      if (is_free[photo] && scores[photo] > 0 && (!best || scores[photo] > scores[*best]))
        best = &photo;
    }
    if (best == nullptr) break;
    if (chosen.empty()) std::ranges::fill(scores, 0);
    chosen.push_back(*best);
    is_free[*best] = false;
    for (const Alike& other : alike_[*best]) scores[other.photo] += other.likeness;
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace veduta
