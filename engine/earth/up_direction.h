// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where is up in a reconstruction, by how people hold cameras: the horizon lies level in most
// photos, and most look about straight ahead.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "storage/base/transform.h"

namespace veduta {

struct UpDirection {
  Eigen::Vector3d up;           // unit vector in the reconstruction
  Eigen::Matrix3d information;  // of errors of `up`, per rad^2; singular along `up` itself
  // What speaks against it beforehand, in squared standard deviations: that photos would be held
  // upside down. Along a straight street the places do not tell the two apart.
  double doubt = 0;
};

// The directions that may be up, the likeliest first: two where the photos look level, and where
// they look down (a drone's), two that are opposite. The same person tilts all photos alike, so
// many photos say no more than a few. None without cameras. O(cameras).
std::vector<UpDirection> FindUp(std::span<const Rigid3> cams_from_world);

}  // namespace veduta
