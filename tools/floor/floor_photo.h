// SPDX-License-Identifier: Apache-2.0
#pragma once
// Takes photographs of a floor, and says where in them each marker truly is.

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "storage/base/transform.h"
#include "storage/model/camera.h"
#include "tools/floor/floor.h"

namespace veduta::floor {

struct FloorCamera {
  std::string name;
  CameraModel model;
  Rigid3 cam_from_world;  // metres
};

struct FloorPhotoOptions {
  double noise_sigma = 2;      // [0, 64] grey levels, after the tone curve
  double blur_sigma_px = 0.7;  // [0, 20]; lens and focus, on light
  double motion_px = 0;        // [0, 100]; length of a straight smear, its middle at the true place
  double motion_deg = 0;       // its direction, from +x towards +y
  double vignetting = 0.3;     // [0, 1]; light lost in the corner
  double unevenness = 0.4;     // [0, 1]; of the light on the floor, with the soft edge of a shadow
  double exposure = 1;         // [0.05, 20]; 1: paper is nearly white
  uint64_t seed = 1;           // of noise and light

  Status Check() const;  // the first violated bound, named with its value
};

// Where a marker is in a photo, even if nothing could find it there.
struct MarkerTruth {
  MarkerId id = 0;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // of the feature point, in the photo as taken
  Eigen::Vector2d outline_center_px =
      Eigen::Vector2d::Zero();  // mean of the outline: what an ellipse fit finds
  double diameter_px = 0;       // across, at the widest
  double tilt_deg = 0;          // between the floor's normal and the line of sight
  double cover = 0;             // part of its ring that something lies on, [0, 1]
  bool is_whole = false;        // all of its quiet zone is in the photo
};

// Markers whose feature point is in the photo, ascending ids. Thread-safe.
std::vector<MarkerTruth> TrueMarkers(const Floor& floor, const FloorCamera& camera);

// The photo, CV_8UC1: one ray for each pixel, or 25 where neighbours differ; then blur, light, tone
// curve (gamma 2.2) and noise. Deterministic; one thread; thread-safe. 3 megapixels take about 1 s
// of one core.
// kInvalidArgument on bad options or a camera that CheckCamera refuses.
Result<cv::Mat> RenderFloorPhoto(const Floor& floor, const FloorCamera& camera,
                                 const FloorPhotoOptions& options);

}  // namespace veduta::floor
