// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points in 3D and the features that see them.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

struct Observation {
  FeatureIndex feature = 0;
  PointId point;
  bool operator==(const Observation&) const = default;
};

struct TrackElement {
  ImageId image;
  FeatureIndex feature = 0;
  bool operator==(const TrackElement&) const = default;
};

struct PointRecord {
  PointId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<uint8_t, 3> rgb{};
  float error_px = 0;               // mean reprojection error
  std::vector<TrackElement> track;  // ascending images, each at most once; at least two
};

// All points that one image is home to: the unit in which points are read and written.
struct PointBlock {
  ImageId home;
  uint32_t next_ordinal = 1;        // never used again while the home has a pose
  std::vector<PointRecord> points;  // ascending ordinals
};

}  // namespace veduta
