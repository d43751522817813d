// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a calibration starts from: where in which photo which point of a flat target was seen. How
// the points lie to each other on their plane is unknown; that they do not move between the photos
// is assumed, and checked.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "storage/model/image_size.h"

namespace veduta {

struct PointObservation {
  uint32_t id = 0;  // of the physical point, the same in all views; at most once in each view
  // In the upright photo as it was taken, distorted. The centre of the top-left pixel is (0, 0).
  Eigen::Vector2d px;
  // > 0; the standard deviation of each coordinate. Only the ratios matter: the scale is estimated.
  double sigma_px = 1;
};

struct ViewObservations {
  std::string name;  // for messages and the report; unique
  ImageSize size;    // of the upright photo; equal in all views of one camera
  std::vector<PointObservation> points;
};

struct CalibrationInput {
  std::vector<ViewObservations> views;  // in any order
};

}  // namespace veduta
