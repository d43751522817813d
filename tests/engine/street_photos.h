// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos of one synthetic street with their truth, rendered in memory, once per process.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "storage/model/camera.h"
#include "tests/storage/samples.h"
#include "tools/render/street/camera_rig.h"
#include "tools/render/street/data_set.h"

namespace veduta {

// Where a photo is taken: metres along the street, in its middle; 90 looks square at the houses on
// the left.
struct Stand {
  double along_m = 0;
  double yaw_deg = 90;
};

struct TakenPhoto {
  std::string name;
  Rigid3 cam_from_world;  // the truth, metres
  std::vector<uint8_t> jpeg;
};

inline CameraModel StreetCameraModel() {
  CameraModel model;
  model.width_px = 512;
  model.height_px = 384;
  model.fx = model.fy = 450;
  model.cx = 255.5;
  model.cy = 191.5;
  model.u0 = model.cx;
  model.v0 = model.cy;
  return model;
}

inline const street::Scene& SharedScene() {
  static const std::unique_ptr<street::Scene> scene = [] {
    street::SceneOptions options;
    options.seed = 7;
    return std::move(*street::BuildScene(options));
  }();
  return *scene;
}

// The same stand gives the same bytes; `exposure_seed` other bytes of the same view. Rendered once
// a process.
inline const TakenPhoto& TakePhoto(const Stand& stand, uint64_t exposure_seed = 1) {
  static std::map<std::tuple<double, double, uint64_t>, TakenPhoto> taken;
  const auto key = std::make_tuple(stand.along_m, stand.yaw_deg, exposure_seed);
  if (const auto it = taken.find(key); it != taken.end()) return it->second;
  const street::Scene& scene = SharedScene();
  const street::Lane& lane = scene.plan().lanes.front();
  const Eigen::Vector2d at = lane.from + stand.along_m * (lane.to - lane.from).normalized();
  // Nobody holds a camera level, or walks a straight line.
  SeededRandom random(static_cast<uint64_t>(std::lround(stand.along_m * 1000)) * 1000 +
                      static_cast<uint64_t>(stand.yaw_deg));
  const auto jitter = [&](double amplitude) { return amplitude * (2 * random.Unit() - 1); };
  street::StreetCamera camera;
  camera.model = StreetCameraModel();
  const double z = 1.6 + jitter(0.1);
  const Eigen::Vector3d center(at.x(), at.y() + jitter(0.3), z);
  const double roll = jitter(2), pitch = 8 + jitter(2), yaw = stand.yaw_deg + jitter(2);
  camera.cam_from_world = street::LookFrom(center, yaw, pitch, roll);
  street::RenderOptions render;
  render.noise_sigma = 2;
  render.seed = exposure_seed;
  char name[64];
  std::snprintf(name, sizeof(name), "walk/%05.2f_%03.0f.jpg", stand.along_m, stand.yaw_deg);
  auto photo = street::RenderPhoto(scene, camera, render);
  auto jpeg =
      photo.ok() ? street::EncodeJpeg(*photo, 92) : Result<std::vector<uint8_t>>(photo.status());
  EXPECT_OK(jpeg);
  return taken[key] = {name, camera.cam_from_world,
                       jpeg.ok() ? std::move(*jpeg) : std::vector<uint8_t>()};
}

// A walk with a photo every `step_m`, the view swinging a little.
inline std::vector<Stand> Walk(double from_m, double step_m, int count) {
  std::vector<Stand> stands;
  for (int i = 0; i < count; ++i)
    stands.push_back({from_m + i * step_m, std::round(90 + 15 * std::cos(M_PI * i / 3))});
  return stands;
}

}  // namespace veduta
