// SPDX-License-Identifier: Apache-2.0
#pragma once
// Features of a photo of any size that is accepted, in memory that its size alone bounds.

#include <cstdint>
#include <opencv2/core.hpp>

#include "engine/features/extractor.h"

namespace veduta {

// Where extraction starts, by the number of pixels alone. The two bounds are chosen so that one
// photo of 100 Mpx, or of 2^25 px, takes less than 1.5 GB with its pixels (PrepareBytes).
enum class FeatureScale : uint8_t {
  kDoubled,  // up to 2^25 px: at twice the photo's size (Lowe 2004, section 3.3)
  kWhole,    // up to 2^26 px: at the photo's size
  kHalved,   // up to 2^28 px: at half the photo's size, each pixel the mean of four
};
FeatureScale FeatureScaleOf(uint64_t pixel_count);

// Memory of one extraction: 9 bytes for each pixel where it starts (FeatureScratch).
uint64_t ExtractionBytes(uint64_t pixel_count);

// As ExtractFeatures, at the scale of FeatureScaleOf; features are in px of `gray` (CV_8UC1).
// kInvalidArgument where a side has less than 16 px where extraction starts, or beyond 2^28 px;
// kNoMemory.
Result<Features> ExtractPhotoFeatures(const cv::Mat& gray, FeatureOptions options,
                                      FeatureScratch* scratch);

}  // namespace veduta
