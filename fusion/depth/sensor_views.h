// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which photos look at what a key view sees, and from where (the paper's section 4.1, equations 7
// and 8).

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/option_fields.h"
#include "storage/base/status.h"

namespace veduta {

// Part of the version of every depth map: raise it whenever a change of the code changes which
// views RankSensorViews chooses (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kSensorViewsVersion = 1;

struct SensorViewOptions {
  double overlap_min = 0.3;   // [0, 1]; the paper's: below it a view is of no use
  double angle_best_deg = 6;  // (0, 90]; a0 of equation 8, the triangulation angle that weighs most
  uint32_t point_count_min =
      12;  // >= 3; points in common, below which neither hull nor angle says much
  uint32_t cells_across =
      32;  // [4, 256]; the grid on the longer side of the image that areas are counted on
  uint32_t cell_feature_count_min =
      1;  // >= 1; features in a cell or the 8 around it that make it relevant

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(SensorViewOptions, overlap_min, angle_best_deg, point_count_min, cells_across,
                     cell_feature_count_min)

// A point of the structure as the key view sees it.
struct SeenPoint {
  Eigen::Vector2d x_px;            // in the key view, undistorted
  Eigen::Vector3d position;        // world
  std::span<const ImageId> track;  // images that see it, ascending; the key view among them or not
};

struct KeyView {
  uint32_t width_px = 0, height_px = 0;
  Eigen::Vector3d center;  // world
  std::vector<Eigen::Vector2d>
      features;  // px of all features, with a point or without: they tell facade from sky
  std::vector<SeenPoint> points;
};

struct SensorView {
  ImageId image;
  double overlap = 0;  // equation 7
  double score = 0;    // equation 8
  double angle_median_deg = 0;
  uint32_t point_count = 0;  // in common
};

// Equation 8's psi(a) = a^2 exp(-2a / a0): the preference for an angle.
double AnglePreference(double angle_deg, double angle_best_deg);

// All views that overlap enough, highest score first (ties: lower id).
//
// overlap  area of the convex hull of the common points' measurements, over the relevant area of
//          the key view, both counted in cells: a cell is relevant where the photo has features at
//          all, so sky, water and blank ground count for nothing. score = overlap * median over the
//          common points of psi(angle).
//
// centers  world, of every image that a track may name; images without one are passed over.
//
// Pure and deterministic. O(points * track + views * (points log points + cells)).
// kInvalidArgument on bad options or a size of 0.
Result<std::vector<SensorView>> RankSensorViews(const KeyView& key,
                                                const std::map<ImageId, Eigen::Vector3d>& centers,
                                                const SensorViewOptions& options);

}  // namespace veduta
