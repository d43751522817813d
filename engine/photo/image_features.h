// SPDX-License-Identifier: Apache-2.0
#pragma once
// One image's features as the engine uses them, and a bounded cache of them.

#include <cstdint>
#include <memory>

#include "engine/matching/feature_grid.h"
#include "engine/matching/packed_descriptors.h"
#include "storage/base/lru_cache.h"
#include "storage/base/status.h"
#include "storage/database.h"
#include "storage/model/pinhole.h"

namespace veduta {

// The features of one image, laid out for matching. Immutable once made.
struct ImageFeatures {
  ImageId id;
  Pinhole camera;
  uint32_t width_px = 0, height_px = 0;
  std::shared_ptr<const Features> features;  // all of them
  std::shared_ptr<const FeatureGrid> grid;   // where all of them lie
  uint32_t matched_count_max = 0;
  PackedDescriptors packed;  // the strongest ones, matched_count_max at most

  // Memory that it takes, about.
  size_t size_bytes() const;

  // kInvalidArgument when matched_count_max exceeds kPackedCountMax.
  static Result<std::shared_ptr<const ImageFeatures>> Make(ImageId id, const CameraModel& camera,
                                                           std::shared_ptr<const Features> features,
                                                           uint32_t matched_count_max);
};

// A bounded cache of stored images' features, least recently used out first; the newest stays,
// however large. Thread-safe. Two threads that miss at once both load, and one result is kept.
class ImageFeatureCache final {
 public:
  ImageFeatureCache(size_t size_bytes_max, uint32_t matched_count_max)
      : cache_(size_bytes_max), matched_count_max_(matched_count_max) {}

  // kNotFound where the image has no stored features. Damaged ones are derived from the photo,
  // which takes about a second; kCorruption where that fails.
  Result<std::shared_ptr<const ImageFeatures>> Get(const Snapshot& snapshot, ImageId id);
  // Keeps the features of an image that was just stored, unless some are kept already.
  void Put(std::shared_ptr<const ImageFeatures> features);
  // Keeps those of an image that was removed no longer.
  void Forget(ImageId id) { cache_.Erase(id); }
  uint32_t matched_count_max() const { return matched_count_max_; }

 private:
  LruCache<ImageId, std::shared_ptr<const ImageFeatures>> cache_;  // costs are bytes
  const uint32_t matched_count_max_;
};

}  // namespace veduta
