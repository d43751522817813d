// SPDX-License-Identifier: Apache-2.0
#pragma once
// SIFT features of one photo: keypoints with contrast sign and DoG magnitude, descriptors as bytes.

#include <cstdint>

#include "storage/base/status.h"
#include "storage/records.h"

namespace veduta {

// A grey image, row-major, 8 bits; `stride_bytes` from row to row.
struct GrayView {
  const uint8_t* pixels = nullptr;
  int width_px = 0, height_px = 0;
  size_t stride_bytes = 0;
};

struct FeatureOptions {
  uint32_t feature_count_max = 8192;   // [1, 65535]; the strongest by |DoG| are kept
  double contrast_threshold = 0.04;    // (0, 1); Lowe 2004, as OpenCV's SIFT reads it
  double edge_ratio_max = 10.0;        // > 1; Lowe 2004, section 4.1
  double sigma = 1.6;                  // blur of the first scale, px; Lowe 2004, section 3.3
  bool upsample = true;                // start at twice the photo's size

  Status Check() const;
};

// Keypoints in px of `image` (centre of the top-left pixel is (0, 0)), strongest response first (ties: by y, x,
// angle); rgb is left zero. Descriptors are root-SIFT quantised to bytes. Deterministic: the same bytes on every
// processor. Single-threaded, thread-safe. kInvalidArgument on bad options or an image under 16 px.
Result<Features> ExtractFeatures(const GrayView& image, const FeatureOptions& options);

}  // namespace veduta
