// SPDX-License-Identifier: Apache-2.0
#pragma once
// The similarity from a reconstruction to the earth, by places that are told for some of its points
// and by what is up in it.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/earth/up_direction.h"
#include "storage/base/transform.h"

namespace veduta {

struct EarthAnchor {
  Eigen::Vector3d world;  // a camera's centre, or a point
  Eigen::Vector3d enu_m;  // where that is said to be
  // Standard deviations to the east, to the north and above, > 0; large above where no height is
  // told.
  Eigen::Vector3d deviation_m;
  // Anchors of one group err together: half of their variance is the same error. The buildings of a
  // street throw GPS off to one side. 0: errs by itself.
  uint32_t group = 0;
  // What its height is above is not told: the sea, or the ellipsoid. All such heights err together.
  bool has_open_height = false;
};

// Where a photo says that its camera looked, by its compass.
struct EarthHeading {
  Eigen::Vector3d forward;  // of the camera, in the world
  double heading_deg = 0;   // clockwise from the true north
  uint32_t group = 0;       // compasses of one group err together; as in EarthAnchor
};

struct EarthFit {
  Sim3 enu_from_world;
  Eigen::Vector3d pivot;                   // as in EarthPlace, like
  Eigen::Matrix<double, 7, 7> covariance;  // this
  std::vector<bool> agrees;                // by anchor
  std::vector<Eigen::Vector3d> error_m;    // by anchor: told minus fitted
  double heading_deviation_deg = 0;        // standard deviations: of the rotation about up,
  double tilt_deviation_deg = 0;           // of the other two together,
  double scale_deviation = 0;              // of the scale, as a share,
  double position_deviation_m = 0;         // and of the pivot, all axes together
};

// Robust least squares (Cauchy, of anchors and of the common errors of groups) over the seven
// degrees of freedom, one common error for each group, and one of all open heights; from the best
// of many pairs of anchors. Headings turn it about up, each group as one: a compass is off by
// some ten degrees, and all photos of a person alike. Nothing where fewer than three anchors are
// given, or where these and the directions leave the similarity open. The covariance counts what
// the errors of anchors and of groups turn out to be, where that is more than they say. An anchor
// of a group that is far off does not agree. Deterministic. O(anchors), for some hundred pairs.
std::optional<EarthFit> FitEarth(std::span<const EarthAnchor> anchors,
                                 std::span<const EarthHeading> headings,
                                 std::span<const UpDirection> up);

}  // namespace veduta
