// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/distortion_inversion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "engine/camera/projection.h"

namespace veduta {

CameraModel InvertDistortion(const InverseDistortion& inverse, const ImageUnits& units,
                             const CameraModel& pinhole, ConversionResidual* residual) {
  CameraModel model = pinhole;
  const Eigen::Vector2d center_px = units.ToPx(inverse.center);
  model.u0 = center_px.x();
  model.v0 = center_px.y();
  constexpr int kAcross = 32, kDown = 24;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> places;  // photo, undistorted; px
  for (int row = 0; row <= kDown; ++row) {
    for (int column = 0; column <= kAcross; ++column) {
      const Eigen::Vector2d photo_px(column * (pinhole.width_px - 1.0) / kAcross,
                                     row * (pinhole.height_px - 1.0) / kDown);
      const Eigen::Vector2d undistorted_px = units.ToPx(inverse.Undistort(units.FromPx(photo_px)));
      places.emplace_back(photo_px, undistorted_px);
      // d = x - c in normalised coordinates; photo - c - d = d r^2 k1 + d r^4 k2.
      const Eigen::Vector2d focal(pinhole.fx, pinhole.fy);
      const Eigen::Vector2d d = (undistorted_px - center_px).cwiseQuotient(focal);
      const Eigen::Vector2d move = (photo_px - undistorted_px).cwiseQuotient(focal);
      const double r2 = d.squaredNorm();
      Eigen::Matrix2d rows;
      rows << d * r2, d * r2 * r2;
      normal += rows.transpose() * rows;
      right += rows.transpose() * move;
    }
  }
  const Eigen::Vector2d k = normal.ldlt().solve(right);
  model.k1 = k[0];
  model.k2 = k[1];
  *residual = {};
  for (const auto& [photo_px, undistorted_px] : places) {
    const double error_px = (DistortPixel(model, undistorted_px) - photo_px).norm();
    residual->mean_px += error_px / static_cast<double>(places.size());
    residual->largest_px = std::max(residual->largest_px, error_px);
  }
  return model;
}

}  // namespace veduta
