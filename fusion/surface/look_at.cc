// SPDX-License-Identifier: Apache-2.0
// Where to look from, and pictures larger and smaller.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "fusion/surface/color_view.h"
#include "fusion/surface/renderer.h"
#include "storage/base/angle.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kSideDeg = 50, kAboveDeg = 20, kFovDeg = 50;
constexpr double kFill = 0.95;  // of the picture by the box

}  // namespace

Result<ViewGeometry> LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                            const Eigen::Vector3d& up, uint32_t width_px, uint32_t height_px,
                            double fov_deg) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Eigen::Matrix3d rows;
  rows << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  if (!rows.allFinite() || std::abs(rows.determinant() - 1) > 1e-6) {
    return Status::InvalidArgument(
        "look-at: eye, target and up are not finite or give no direction");
  }
  if (!(fov_deg > 0 && fov_deg < 180)) {
    return Status::InvalidArgument("look-at: field of view " + std::to_string(fov_deg) +
                                   " is outside (0, 180)");
  }
  ViewGeometry view;
  view.width_px = width_px;
  view.height_px = height_px;
  view.camera.fx = view.camera.fy = 0.5 * width_px / std::tan(0.5 * fov_deg * kRadPerDeg);
  view.camera.cx = (width_px - 1.0) / 2;
  view.camera.cy = (height_px - 1.0) / 2;
  view.cam_from_world.rotation = Eigen::Quaterniond(rows).normalized();
  view.cam_from_world.translation = -(view.cam_from_world.rotation * eye);
  return view;
}

Result<std::array<ViewGeometry, 3>> ThreeSides(const Eigen::AlignedBox3d& box,
                                               const Eigen::Vector3d& up,
                                               const Eigen::Vector3d& forward, uint32_t width_px,
                                               uint32_t height_px) {
  if (box.isEmpty()) return Status::InvalidArgument("look-at: there is nothing to look at");
  const Eigen::Vector3d y = up.normalized();
  Eigen::Vector3d level = forward - forward.dot(y) * y;
  if (level.norm() < 1e-6) level = y.unitOrthogonal();  // all photos look up or down
  level.normalize();
  std::array<ViewGeometry, 3> views;
  const double turns[3] = {0, kSideDeg, -kSideDeg};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d turned = Eigen::AngleAxisd(turns[i] * kRadPerDeg, y) * level;
    const Eigen::Vector3d direction =
        std::cos(kAboveDeg * kRadPerDeg) * turned - std::sin(kAboveDeg * kRadPerDeg) * y;
    const Eigen::Vector3d middle = box.center();
    VEDUTA_ASSIGN_OR_RETURN(ViewGeometry view,
                            LookAt(middle - direction, middle, y, width_px, height_px, kFovDeg));
    // The least distance from which each corner is in the frustum: |x| <= tan (z + distance).
    const double across = kFill * 0.5 * width_px / view.camera.fx,
                 down = kFill * 0.5 * height_px / view.camera.fy;
    double distance = 1e-6 + box.diagonal().norm() / 2;  // not in the box
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d off =
          view.cam_from_world.rotation *
          (box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) - middle);
      distance = std::max(
          {distance, std::abs(off.x()) / across - off.z(), std::abs(off.y()) / down - off.z()});
    }
    VEDUTA_ASSIGN_OR_RETURN(
        views[i], LookAt(middle - distance * direction, middle, y, width_px, height_px, kFovDeg));
  }
  return views;
}

ViewGeometry ScaledView(const ViewGeometry& view, double factor) {
  ViewGeometry scaled = view;
  scaled.width_px = static_cast<uint32_t>(std::lround(view.width_px * factor));
  scaled.height_px = static_cast<uint32_t>(std::lround(view.height_px * factor));
  scaled.camera.fx *= factor;
  scaled.camera.fy *= factor;
  scaled.camera.cx = (view.camera.cx + 0.5) * factor - 0.5;
  scaled.camera.cy = (view.camera.cy + 0.5) * factor - 0.5;
  return scaled;
}

Picture Reduced(const Picture& picture, uint32_t factor) {
  Picture small = {picture.width_px / factor, picture.height_px / factor, {}, {}};
  const size_t pixels = size_t{small.width_px} * small.height_px;
  small.rgb.resize(3 * pixels);
  small.depth.resize(pixels);
  for (size_t i = 0; i < pixels; ++i) {
    float light[3] = {}, nearest = 0;
    for (uint32_t k = 0; k < factor * factor; ++k) {
      const size_t at = (i / small.width_px * factor + k / factor) * picture.width_px +
                        i % small.width_px * factor + k % factor;
      for (int c = 0; c < 3; ++c) light[c] += LightFromSrgb(picture.rgb[3 * at + c]);
      const float depth = picture.depth[at];
      if (depth > 0 && (nearest == 0 || depth < nearest)) nearest = depth;
    }
    small.depth[i] = nearest;
    for (int c = 0; c < 3; ++c) {
      small.rgb[3 * i + c] = SrgbFromLight(light[c] / static_cast<float>(factor * factor));
    }
  }
  return small;
}

Status WritePng(const std::string& path, uint32_t width_px, uint32_t height_px,
                std::span<const uint8_t> rgb) {
  if (width_px < 1 || height_px < 1 || rgb.size() != size_t{width_px} * height_px * 3) {
    return Status::InvalidArgument(path + ": " + std::to_string(rgb.size()) + " bytes for " +
                                   std::to_string(width_px) + "x" + std::to_string(height_px) +
                                   " pixels");
  }
  cv::Mat image(static_cast<int>(height_px), static_cast<int>(width_px), CV_8UC3);
  for (size_t i = 0; i < rgb.size(); i += 3) {
    for (int c = 0; c < 3; ++c) image.data[i + c] = rgb[i + 2 - c];  // OpenCV wants blue first
  }
  try {
    if (cv::imwrite(path, image)) return {};
  } catch (const cv::Exception&) {  // an ending that is no picture's
  }
  const bool is_named_so = std::filesystem::path(path).extension() == ".png";
  return Status::IoError("cannot write " + path +
                         (is_named_so ? ": is its folder there, and has the disk room?"
                                      : "; its name must end in .png"));
}

}  // namespace veduta
