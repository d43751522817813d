// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the street's tests share: small cameras, and a photo with its camera and depth to carry
// points by.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "tools/render/street/data_set.h"

namespace veduta::street {

class Folder {
 public:
  explicit Folder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("veduta_street_" + std::to_string(getpid()) + "_" + name)) {
    std::filesystem::remove_all(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::string str() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

inline CameraModel MakeModel(uint32_t width, uint32_t height, double focal) {
  CameraModel model;
  model.width_px = width;
  model.height_px = height;
  model.fx = model.fy = focal;
  model.cx = model.u0 = (width - 1) / 2.0;
  model.cy = model.v0 = (height - 1) / 2.0;
  return model;
}

inline CameraModel MakeDistortedModel() {
  CameraModel model = MakeModel(320, 240, 280);
  model.fy = 276;
  model.k1 = -0.17;
  model.k2 = 0.04;
  model.u0 += 5;
  model.v0 -= 4;
  return model;
}

// The equation of storage/model/camera.h, written out once more.
inline Eigen::Vector2d Distorted(const CameraModel& m, const Eigen::Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z();
  const double cx = (m.u0 - m.cx) / m.fx, cy = (m.v0 - m.cy) / m.fy;
  const double r = std::hypot(x - cx, y - cy),
               factor = 1 + m.k1 * std::pow(r, 2) + m.k2 * std::pow(r, 4);
  return {m.fx * (cx + (x - cx) * factor) + m.cx, m.fy * (cy + (y - cy) * factor) + m.cy};
}

struct View {
  StreetCamera camera;
  StreetPhoto photo;
  std::shared_ptr<const RayTable> rays;

  bool Inside(const Eigen::Vector2d& p) const {
    return p.x() >= 0 && p.y() >= 0 && p.x() <= photo.width_px - 1.001 &&
           p.y() <= photo.height_px - 1.001;
  }
  float DepthAt(const Eigen::Vector2d& p) const {
    return photo.depth[std::lround(p.y()) * size_t{photo.width_px} + std::lround(p.x())];
  }
  Eigen::Vector3d PointInWorld(uint32_t u, uint32_t v) const {
    const size_t i = size_t{v + 1} * rays->stride() + u + 1;
    const double z = photo.depth[size_t{v} * photo.width_px + u];
    return camera.cam_from_world.Inverse() * Eigen::Vector3d(rays->x[i] * z, rays->y[i] * z, z);
  }
  // Grey value between pixels, bilinear.
  double GreyAt(const Eigen::Vector2d& p) const {
    const int u = static_cast<int>(p.x()), v = static_cast<int>(p.y());
    const double a = p.x() - u, b = p.y() - v;
    const auto grey = [&](int x, int y) {
      const uint8_t* c =
          photo.rgb.data() + (size_t{static_cast<uint32_t>(y)} * photo.width_px + x) * 3;
      return (c[0] + c[1] + c[2]) / 3.0;
    };
    return (1 - b) * ((1 - a) * grey(u, v) + a * grey(u + 1, v)) +
           b * ((1 - a) * grey(u, v + 1) + a * grey(u + 1, v + 1));
  }
};

inline View Take(const Scene& scene, const StreetCamera& camera, RenderOptions options = {}) {
  options.depth = true;
  Result<StreetPhoto> photo = RenderPhoto(scene, camera, options);
  EXPECT_TRUE(photo.ok()) << photo.status().message();
  return {camera, std::move(photo).value(), scene.Rays(camera.model).value()};
}

inline std::unique_ptr<Scene> Build(const SceneOptions& options) {
  Result<std::unique_ptr<Scene>> scene = BuildScene(options);
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  return std::move(scene).value();
}

}  // namespace veduta::street
