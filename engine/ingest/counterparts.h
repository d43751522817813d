// SPDX-License-Identifier: Apache-2.0
#pragma once
// The features of one picture in another copy of it, of another size or by another camera's lens.

#include <Eigen/Core>
#include <vector>

#include "storage/model/camera.h"
#include "storage/model/features.h"
#include "storage/model/image_size.h"

namespace veduta {

// A copy of a picture: its camera, and the features that were extracted from it.
struct PictureCopy {
  const CameraModel& camera;
  const Features& features;
  uint8_t orientation = 0;  // as ImageRecord has it

  ImageSize upright_size() const;
};

// Where the feature lies in the photo with its lens, upright, over its size: [0, 1] x [0, 1].
Eigen::Vector2d PlaceInPicture(const PictureCopy& copy, const Keypoint& keypoint);

// Which feature of `second` shows what a feature of `first` shows: those that lie at the same place
// of the picture and look alike, the most alike first, each feature once. Ascending in a, which is
// of `first`. Deterministic. O(features of the one times features of the other).
std::vector<FeatureMatch> FindCounterparts(const PictureCopy& first, const PictureCopy& second);

}  // namespace veduta
