// SPDX-License-Identifier: Apache-2.0
#include "engine/features/orientation.h"

#include <algorithm>

namespace veduta {
namespace {

constexpr double kWindowSigma = 1.5;  // times the keypoint's scale; Lowe 2004, section 5
constexpr double kWindowReach = 3.0;  // times the window's sigma; as in OpenCV's SIFT
constexpr float kPeakShare = 0.8f;    // of the highest peak; Lowe 2004, section 5
constexpr float kBinDeg = 360.0f / kOrientationBins;

}  // namespace

Directions FindDirections(const SiftKernels& kernels, const GrayPlane& plane, double x, double y,
                          double sigma) {
  float raw[kOrientationBins] = {};
  const double window = kWindowSigma * sigma;
  const int radius =
      std::clamp(static_cast<int>(kWindowReach * window + 0.5), 1, kOrientationRadiusMax);
  kernels.orientation_histogram(plane, static_cast<float>(x), static_cast<float>(y),
                                static_cast<float>(window), radius, raw);
  const auto at = [&raw](int i) { return raw[(i + kOrientationBins) % kOrientationBins]; };
  float smooth[kOrientationBins];  // by 1 : 4 : 6 : 4 : 1, as in OpenCV's SIFT
  for (int i = 0; i < kOrientationBins; ++i) {
    smooth[i] = (at(i - 2) + at(i + 2)) * (1.0f / 16) + (at(i - 1) + at(i + 1)) * (4.0f / 16) +
                at(i) * (6.0f / 16);
  }
  const int highest =
      static_cast<int>(std::max_element(smooth, smooth + kOrientationBins) - smooth);
  Directions result;
  for (int i = 0; i < kOrientationBins; ++i) {
    const float left = smooth[(i + kOrientationBins - 1) % kOrientationBins];
    const float right = smooth[(i + 1) % kOrientationBins];
    if (smooth[i] < kPeakShare * smooth[highest] || smooth[i] <= left || smooth[i] <= right)
      continue;
    // The top of the parabola through three bins.
    const float bin =
        static_cast<float>(i) + 0.5f * (left - right) / (left - 2.0f * smooth[i] + right);
    float angle = bin * kBinDeg;
    if (angle < 0.0f) angle += 360.0f;
    if (angle >= 360.0f) angle -= 360.0f;
    result.angle_deg[result.count++] = angle;
  }
  // A plateau has no peak. Its first bin serves instead.
  if (result.count == 0) result.angle_deg[result.count++] = static_cast<float>(highest) * kBinDeg;
  return result;
}

}  // namespace veduta
