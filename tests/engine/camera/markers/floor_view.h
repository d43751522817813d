// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rendered photos of markers for tests, small enough to be quick.

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "tools/render/floor/session.h"

namespace veduta::testing {

inline CameraModel FloorCameraModel(uint32_t width_px = 800, uint32_t height_px = 600) {
  CameraModel model;
  model.width_px = width_px;
  model.height_px = height_px;
  model.fx = model.fy = 0.95 * width_px;
  model.cx = 0.5 * width_px + 4;
  model.cy = 0.5 * height_px - 3;
  model.u0 = model.cx - 5;
  model.v0 = model.cy + 4;
  model.k1 = -0.12;
  model.k2 = 0.03;
  return model;
}

struct FloorView {
  cv::Mat gray;
  std::vector<floor::MarkerTruth> truths;
};

// A photo from straight above or slanted in which a marker in the middle is `diameter_px` across.
inline FloorView TakeFloorView(const floor::FloorOptions& options, double diameter_px,
                               double tilt_deg, const floor::FloorPhotoOptions& photo,
                               const CameraModel& model = FloorCameraModel()) {
  const floor::Floor floor = floor::Floor::Build(options).value();
  const auto nearest = std::min_element(
      floor.markers().begin(), floor.markers().end(), [](const auto& a, const auto& b) {
        return a.center_m.squaredNorm() < b.center_m.squaredNorm();
      });
  const Eigen::Vector2d target_m = nearest->center_m.head<2>() + Eigen::Vector2d(0.005, 0.003);
  const double distance_m = model.fx * 2 * floor.markers().front().radius_m / diameter_px;
  const floor::FloorCamera camera = {"view", model,
                                     floor::LookDown(target_m, distance_m, tilt_deg, 40, 25)};
  return {floor::RenderFloorPhoto(floor, camera, photo).value(), floor::TrueMarkers(floor, camera)};
}

inline std::vector<uint8_t> EncodeGrayJpeg(const cv::Mat& gray, int quality = 90) {
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", gray, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
  return jpeg;
}

}  // namespace veduta::testing
