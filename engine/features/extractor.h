// SPDX-License-Identifier: Apache-2.0
#pragma once
// SIFT features of one photo: keypoints with contrast sign and DoG magnitude, descriptors as bytes.

#include <memory>

#include "engine/features/feature_options.h"
#include "storage/base/status.h"
#include "storage/model/features.h"

namespace veduta {

// Memory that one extraction leaves for the next, about 9 bytes for each pixel of the doubled
// photo: touching fresh pages adds a fifth to the time of an extraction. One photo at a time; not
// thread-safe.
class FeatureScratch final {
 public:
  FeatureScratch();
  ~FeatureScratch();
  FeatureScratch(const FeatureScratch&) = delete;
  FeatureScratch& operator=(const FeatureScratch&) = delete;

  struct Memory;
  Memory& memory() { return *memory_; }

 private:
  std::unique_ptr<Memory> memory_;
};

// Keypoints in px of `image` (centre of the top-left pixel is (0, 0)), strongest response first
// (ties: by y, x, scale, angle); rgb is left zero. A keypoint with several dominant directions
// gives several features. Descriptors are root-SIFT quantised to bytes: 4 x 4 x 8 (row, column,
// direction), of norm 512 but for rounding. Deterministic: the same bytes on every processor, with
// or without scratch. Single-threaded; thread-safe if no scratch is shared. kInvalidArgument on bad
// options, an image under 16 px in width or height, or an image of more than 2^26 px; kNoMemory
// when memory runs out.
Result<Features> ExtractFeatures(const GrayView& image, const FeatureOptions& options,
                                 FeatureScratch* scratch = nullptr);

}  // namespace veduta
