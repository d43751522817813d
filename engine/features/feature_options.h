// SPDX-License-Identifier: Apache-2.0
#pragma once
// What features are extracted from, and how (extractor.h).

#include <cstddef>
#include <cstdint>

#include "storage/base/status.h"

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

}  // namespace veduta
