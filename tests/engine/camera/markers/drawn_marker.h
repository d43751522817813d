// SPDX-License-Identifier: Apache-2.0
#pragma once
// One marker drawn as its definition says, for tests of the steps that look at one marker.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <opencv2/core.hpp>

#include "engine/camera/markers/marker_pattern.h"

namespace veduta::testing {

inline constexpr double kInkGray = 30, kPaperGray = 220;

// A marker on paper in an image of 240 x 200 px. Each pixel is the mean of 5 x 5 places.
struct DrawnMarker {
  Eigen::Matrix3d image_from_unit = Eigen::Matrix3d::Identity();
  cv::Mat gray;

  // half_axes_px: of the dark ring's outline before the turn.
  DrawnMarker(MarkerId id, const Eigen::Vector2d& center_px, const Eigen::Vector2d& half_axes_px,
              double turn_rad)
      : gray(200, 240, CV_8UC1) {
    image_from_unit.topLeftCorner<2, 2>() =
        half_axes_px.asDiagonal() * Eigen::Rotation2Dd(turn_rad).toRotationMatrix();
    image_from_unit.topRightCorner<2, 1>() = center_px;
    const Eigen::Matrix3d unit_from_image = image_from_unit.inverse();
    for (int v = 0; v < gray.rows; ++v) {
      for (int u = 0; u < gray.cols; ++u) {
        int dark = 0;
        for (int i = 0; i < 25; ++i) {
          const Eigen::Vector3d unit =
              unit_from_image *
              Eigen::Vector3d(u + 0.2 * (i % 5) - 0.4, v + 0.2 * (i / 5) - 0.4, 1);
          dark += IsMarkerDark(id, unit.x(), unit.y());
        }
        gray.at<uint8_t>(v, u) =
            static_cast<uint8_t>(std::lround(kPaperGray - dark / 25. * (kPaperGray - kInkGray)));
      }
    }
  }

  // Lays something grey over the ring from sector `first` on, `count` sectors, from the
  // checkerboard to beyond the paper around it.
  void CoverSectors(int first, int count, uint8_t value = 125) {
    const Eigen::Matrix3d unit_from_image = image_from_unit.inverse();
    for (int v = 0; v < gray.rows; ++v) {
      for (int u = 0; u < gray.cols; ++u) {
        const Eigen::Vector3d unit = unit_from_image * Eigen::Vector3d(u, v, 1);
        const double turn = std::atan2(unit.y(), unit.x()) / (2 * M_PI);
        const double sector = (turn < 0 ? turn + 1 : turn) * kMarkerBitCount;
        if (unit.head<2>().norm() > kMarkerBoardRadius && sector >= first && sector < first + count)
          gray.at<uint8_t>(v, u) = value;
      }
    }
  }
};

}  // namespace veduta::testing
