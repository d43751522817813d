// SPDX-License-Identifier: Apache-2.0
#pragma once
// SIFT features of one photo: keypoints with contrast sign and DoG magnitude, descriptors as bytes.

#include <cstddef>
#include <cstdint>
#include <memory>

#include "storage/base/status.h"
#include "storage/model/features.h"

namespace veduta {

// A grey image, row-major, 8 bits; `stride_bytes` from row to row.
struct GrayView {
  const uint8_t* pixels = nullptr;
  int width_px = 0, height_px = 0;
  size_t stride_bytes = 0;
};

struct FeatureOptions {
  // [1, 65535]: the strongest by |DoG| are kept. Chosen by hand; not measured.
  uint32_t feature_count_max = 8192;
  // (0, 1) of the gray range: the default of OpenCV's SIFT. As there, |DoG| must exceed a third of
  // it, since an octave has three scales (Lowe 2004, section 4, takes 0.03 undivided).
  double contrast_threshold = 0.04;
  // (1, 1000]: of the principal curvatures; Lowe 2004, section 4.1.
  double edge_ratio_max = 10.0;
  // [1.4, 4] px: blur of the first scale; Lowe 2004, section 3.3.
  double sigma = 1.6;
  // Whether to start at twice the photo's size; Lowe 2004, section 3.3.
  bool upsample = true;

  Status Check() const;  // the first violated bound, named with its value
};

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
