// SPDX-License-Identifier: Apache-2.0
#pragma once
// A pose by points and by the epipolar lines of placed neighbours together.

#include <span>
#include <vector>

#include "storage/base/transform.h"

namespace veduta {

// A placed image and the verified matches with it, in normalised image coordinates.
struct PlacedMatches {
  Rigid3 cam_from_world;                    // of the placed image
  std::vector<Eigen::Vector2d> x, x_other;  // of the photo at hand, and of the placed image
  double scale = 0;  // of the Sampson distances beyond which matches lose weight
};

struct JointPose {
  Rigid3 cam_from_world;
  double cost = 0;
};

// Minimises, over the six degrees of freedom of the pose, the sum of log(1 + e^2 / scale^2) over
// the reprojection errors of the points (x, points) and the Sampson distances of the matches
// (Levenberg-Marquardt, with the Cauchy loss). Points in a small part of the picture, such as a
// house front far down the street, leave the centre open along an arc around them; what is seen
// nearby is in few points yet, but its epipolar lines close the arc. A point behind the camera
// costs as much as an error of 45 degrees; matches are not asked whether they lie in front.
//
// `start` is near the pose; `scale`, that of the points' errors, is in normalised units.
// Deterministic. Thread-safe. O(iterations * (points + matches)).
JointPose RefineJointly(const Rigid3& start, std::span<const Eigen::Vector2d> x,
                        std::span<const Eigen::Vector3d> points,
                        std::span<const PlacedMatches> neighbors, double scale);

}  // namespace veduta
