// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/private_features.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

// A circle in the photo as it was taken that the support of the feature lies in.
struct Support {
  Eigen::Vector2d middle;
  double radius = 0;
};

Support SupportOf(const Keypoint& k, const CameraModel* camera) {
  const Eigen::Vector2d at(k.x_px, k.y_px);
  const double radius = kSupportRadius * k.scale_px;
  if (camera == nullptr) return {at, radius};
  Support support{DistortPixel(*camera, at), 0};
  constexpr int kRays = 8;
  for (int i = 0; i < kRays; ++i) {
    const double angle = i * (2 * EIGEN_PI / kRays);
    const Eigen::Vector2d edge =
        DistortPixel(*camera, at + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    support.radius = std::max(support.radius, (edge - support.middle).norm());
  }
  return support;
}

bool Touches(const Support& support, const PixelArea& area) {
  // Pixels reach half a pixel around their centres.
  const double left = area.x - 0.5, top = area.y - 0.5;
  const Eigen::Vector2d nearest(std::clamp(support.middle.x(), left, left + area.width),
                                std::clamp(support.middle.y(), top, top + area.height));
  return (support.middle - nearest).norm() <= support.radius;
}

}  // namespace

void DropPrivate(std::span<const PixelArea> areas, const CameraModel* camera, Features* features) {
  if (areas.empty()) return;
  size_t kept = 0;
  for (size_t i = 0; i < features->size(); ++i) {
    const Support support = SupportOf(features->keypoints[i], camera);
    if (std::ranges::any_of(areas, [&](const auto& area) { return Touches(support, area); }))
      continue;
    features->keypoints[kept] = features->keypoints[i];
    std::copy_n(features->descriptor(i), kDescriptorSize,
                features->descriptors.begin() + kept * kDescriptorSize);
    ++kept;
  }
  features->keypoints.resize(kept);
  features->descriptors.resize(kept * kDescriptorSize);
}

}  // namespace veduta
