// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/local_frame.h"

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <vector>

namespace veduta {

struct LocalFrame::Frame {
  GeographicLib::LocalCartesian projection;
};

LocalFrame::LocalFrame(const GeoPosition& origin)
    : frame_(new Frame{GeographicLib::LocalCartesian(origin.latitude_deg, origin.longitude_deg,
                                                     origin.height_m)}) {}
LocalFrame::~LocalFrame() = default;

Eigen::Vector3d LocalFrame::FromGeo(const GeoPosition& position) const {
  Eigen::Vector3d enu;
  frame_->projection.Forward(position.latitude_deg, position.longitude_deg, position.height_m,
                             enu.x(), enu.y(), enu.z());
  return enu;
}

GeoPosition LocalFrame::ToGeo(const Eigen::Vector3d& enu_m,
                              Eigen::Matrix3d* enu_there_from_here) const {
  GeoPosition position;
  std::vector<double> turn(9);  // row by row: from the frame there to this one
  frame_->projection.Reverse(enu_m.x(), enu_m.y(), enu_m.z(), position.latitude_deg,
                             position.longitude_deg, position.height_m, turn);
  if (enu_there_from_here != nullptr) {
    *enu_there_from_here =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn.data()).transpose();
  }
  return position;
}

Eigen::Matrix4d LocalFrame::EcefFromEnu() const {
  const auto& frame = frame_->projection;
  Eigen::Matrix4d ecef_from_enu = Eigen::Matrix4d::Identity();
  std::vector<double> turn(9);  // row by row
  GeographicLib::Geocentric::WGS84().Forward(frame.LatitudeOrigin(), frame.LongitudeOrigin(),
                                             frame.HeightOrigin(), ecef_from_enu(0, 3),
                                             ecef_from_enu(1, 3), ecef_from_enu(2, 3), turn);
  ecef_from_enu.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn.data());
  return ecef_from_enu;
}

}  // namespace veduta
