// SPDX-License-Identifier: Apache-2.0
#pragma once
// A plane that touches the earth: metres to the east, the north and above of an origin (by
// GeographicLib's LocalCartesian on WGS 84; exact at any distance, for it is a rotation of the
// coordinates whose origin is the earth's centre).

#include <Eigen/Core>
#include <memory>

#include "storage/model/geo.h"

namespace veduta {

// Immutable, so thread-safe.
class LocalFrame final {
 public:
  explicit LocalFrame(const GeoPosition& origin);
  ~LocalFrame();

  Eigen::Vector3d FromGeo(const GeoPosition& position) const;
  // `enu_there_from_here`, if given, receives the rotation from this frame to the frame whose
  // origin is the position.
  GeoPosition ToGeo(const Eigen::Vector3d& enu_m,
                    Eigen::Matrix3d* enu_there_from_here = nullptr) const;
  // From this frame to metres about the earth's centre (EPSG:4978): x through latitude and
  // longitude 0, z through the north pole. A rigid transform, as a matrix.
  Eigen::Matrix4d EcefFromEnu() const;

 private:
  struct Frame;
  std::unique_ptr<const Frame> frame_;
};

}  // namespace veduta
