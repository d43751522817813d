// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is found in one photo to recognize it by, and what two photos have in common.

#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

inline constexpr int kDescriptorSize = 128;  // bytes of a SIFT descriptor, one per bin

// One SIFT feature of the undistorted image.
struct Keypoint {
  float x_px = 0, y_px = 0;
  float scale_px = 0;   // sigma of the Gaussian at which it was found
  float angle_deg = 0;  // dominant gradient orientation, [0, 360)
  float response = 0;   // |DoG|, the strength that features are ranked by
  int8_t contrast_sign =
      0;  // sign of the Laplacian: +1 dark blob on bright ground, -1 bright on dark
  std::array<uint8_t, 3> rgb{};

  bool operator==(const Keypoint&) const = default;
};

// The features of one photo, strongest response first.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<uint8_t> descriptors;  // [keypoints.size() x 128], row-major

  size_t size() const { return keypoints.size(); }
  const uint8_t* descriptor(size_t i) const { return descriptors.data() + i * kDescriptorSize; }
};

struct FeatureMatch {
  FeatureIndex a = 0, b = 0;
  bool operator==(const FeatureMatch&) const = default;
};

}  // namespace veduta
