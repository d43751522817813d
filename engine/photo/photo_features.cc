// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_features.h"

#include <exception>
#include <opencv2/imgproc.hpp>

namespace veduta {
namespace {

constexpr uint64_t kDoubledPixelsMax = 1ull << 25;  // see FeatureScale
constexpr uint64_t kWholePixelsMax = 1ull << 26;    // ExtractFeatures takes no more

Result<Features> ExtractFrom(const cv::Mat& gray, const FeatureOptions& options,
                             FeatureScratch* scratch) {
  return ExtractFeatures({gray.data, gray.cols, gray.rows, gray.step}, options, scratch);
}

// An odd last column or row is left out.
Result<cv::Mat> Halve(const cv::Mat& gray) {
  try {
    const cv::Size size(gray.cols / 2, gray.rows / 2);
    cv::Mat half;
    cv::resize(gray(cv::Rect(0, 0, 2 * size.width, 2 * size.height)), half, size, 0, 0,
               cv::INTER_AREA);
    return half;
  } catch (const std::exception&) {
    return Status::NoMemory("there is not enough memory to halve the photo");
  }
}

}  // namespace

FeatureScale FeatureScaleOf(uint64_t pixel_count) {
  if (pixel_count <= kDoubledPixelsMax) return FeatureScale::kDoubled;
  return pixel_count <= kWholePixelsMax ? FeatureScale::kWhole : FeatureScale::kHalved;
}

uint64_t ExtractionBytes(uint64_t pixel_count) {
  switch (FeatureScaleOf(pixel_count)) {
    case FeatureScale::kDoubled:
      return 9 * 4 * pixel_count;
    case FeatureScale::kWhole:
      return 9 * pixel_count;
    case FeatureScale::kHalved:
      break;
  }
  return (9 + 1) * pixel_count / 4;  // with the halved photo itself
}

Result<Features> ExtractPhotoFeatures(const cv::Mat& gray, FeatureOptions options,
                                      FeatureScratch* scratch) {
  const FeatureScale scale = FeatureScaleOf(gray.total());
  options.upsample = options.upsample && scale == FeatureScale::kDoubled;
  if (scale != FeatureScale::kHalved) return ExtractFrom(gray, options, scratch);
  VEDUTA_ASSIGN_OR_RETURN(const cv::Mat half, Halve(gray));
  VEDUTA_ASSIGN_OR_RETURN(Features features, ExtractFrom(half, options, scratch));
  for (Keypoint& k : features.keypoints) {  // a pixel's centre lies between those of four
    k.x_px = 2 * k.x_px + 0.5f;
    k.y_px = 2 * k.y_px + 0.5f;
    k.scale_px *= 2;
  }
  return features;
}

}  // namespace veduta
