// SPDX-License-Identifier: Apache-2.0
#pragma once
// One image's features as the engine uses them, and a bounded cache of them.

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "engine/matching/feature_grid.h"
#include "engine/matching/packed_descriptors.h"
#include "storage/base/status.h"
#include "storage/database.h"
#include "storage/model/pinhole.h"

namespace veduta {

// Immutable once made.
struct ImageFeatures {
  ImageId id;
  Pinhole camera;
  uint32_t width_px = 0, height_px = 0;
  std::shared_ptr<const Features> features;  // all of them
  std::shared_ptr<const FeatureGrid> grid;   // of all of them
  uint32_t matched_count_max = 0;
  PackedDescriptors packed;  // of the strongest, matched_count_max at most

  size_t size_bytes() const;

  static Result<std::shared_ptr<const ImageFeatures>> Make(ImageId id, const CameraModel& camera,
                                                           std::shared_ptr<const Features> features,
                                                           uint32_t matched_count_max);
};

// Keeps the least recently used out. Thread-safe; two threads that miss at once both load, and one
// result is kept.
class ImageFeatureCache final {
 public:
  ImageFeatureCache(size_t size_bytes_max, uint32_t matched_count_max)
      : size_bytes_max_(size_bytes_max), matched_count_max_(matched_count_max) {}

  // kNotFound where the image has no stored features.
  Result<std::shared_ptr<const ImageFeatures>> Get(const Snapshot& snapshot, ImageId id);
  void Put(std::shared_ptr<const ImageFeatures> features);
  uint32_t matched_count_max() const { return matched_count_max_; }

 private:
  using Order = std::list<std::shared_ptr<const ImageFeatures>>;

  const size_t size_bytes_max_;
  const uint32_t matched_count_max_;
  std::mutex mutex_;
  Order order_;  // most recently used first
  std::unordered_map<ImageId, Order::iterator> by_id_;
  size_t size_bytes_ = 0;
};

}  // namespace veduta
