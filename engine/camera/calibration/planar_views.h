// SPDX-License-Identifier: Apache-2.0
#pragma once
// The observations as the steps of the estimation use them: points numbered densely, positions
// about the centre of the image in units of its longer side, so that every number is about 1
// whatever the camera.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/camera/calibration/observations.h"
#include "storage/model/image_size.h"

namespace veduta {

// px = center_px + unit_px * x.
struct ImageUnits {
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  double unit_px = 1;

  ImageUnits() = default;
  explicit ImageUnits(ImageSize size);

  Eigen::Vector2d FromPx(const Eigen::Vector2d& px) const { return (px - center_px) / unit_px; }
  Eigen::Vector2d ToPx(const Eigen::Vector2d& x) const { return center_px + unit_px * x; }
};

struct PlanarPoint {
  uint32_t point = 0;  // dense: 0 .. point_count - 1
  Eigen::Vector2d x;   // in ImageUnits
  double sigma = 1;    // in ImageUnits
};

using PlanarView = std::vector<PlanarPoint>;  // ascending by point, each at most once

struct PlanarViews {
  ImageUnits units;
  std::vector<PlanarView> views;    // in the order of the input
  std::vector<uint32_t> point_ids;  // ascending; the id of each dense point
};

// Expects views of one size. A point that a view lists twice is dropped from that view, because one
// of the two is misread.
PlanarViews MakePlanarViews(const CalibrationInput& input);

// Of each point that both views see: its index in a and its index in b, ascending by point. O(|a| +
// |b|).
std::vector<std::pair<uint32_t, uint32_t>> CommonPoints(const PlanarView& a, const PlanarView& b);

}  // namespace veduta
