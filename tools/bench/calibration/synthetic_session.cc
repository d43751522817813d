// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/calibration/synthetic_session.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/camera/projection.h"
#include "storage/base/angle.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

class Dice final {
 public:
  explicit Dice(uint64_t seed) : random_(seed) {}
  double Between(double low, double high) { return low + (high - low) * random_.Unit(); }
  double Gaussian() {  // Box and Muller
    return std::sqrt(-2 * std::log(1 - random_.Unit())) *
           std::cos(2 * std::numbers::pi * random_.Unit());
  }
  uint32_t Below(uint32_t bound) { return random_.Below(bound); }

 private:
  SeededRandom random_;
};

// A4 sheets of 2 by 3 markers; each bulges along one direction and lies on one edge.
std::vector<Eigen::Vector3d> LayOutSheets(const SessionOptions& options, Dice* dice) {
  std::vector<Eigen::Vector3d> points;
  const double height = options.sheet_height_mm / 1000;
  for (int sheet = 0; sheet < 16; ++sheet) {
    const Eigen::Vector2d middle((sheet % 4 - 1.5) * 0.27 + dice->Between(-0.02, 0.02),
                                 (sheet / 4 - 1.5) * 0.36 + dice->Between(-0.02, 0.02));
    const Eigen::Rotation2Dd turn(dice->Between(-8, 8) * kRadPerDeg +
                                  (dice->Below(2) ? std::numbers::pi : 0));
    const double bend = dice->Between(0, 2 * std::numbers::pi);
    const double bulge = dice->Between(-0.2, 1) * height, lift = dice->Between(0, 0.5) * height;
    for (int marker = 0; marker < 6; ++marker) {
      const Eigen::Vector2d on_sheet((marker % 2 - 0.5) * 0.095, (marker / 2 - 1) * 0.092);
      const double along = (on_sheet.x() * std::cos(bend) + on_sheet.y() * std::sin(bend)) / 0.13;
      const Eigen::Vector2d on_floor = middle + turn * on_sheet;
      points.emplace_back(on_floor.x(), on_floor.y(),
                          bulge * (1 - along * along) + lift * (1 + along));
    }
  }
  return points;
}

CameraModel MakeCamera(const SessionOptions& options, Dice* dice) {
  CameraModel camera;
  const double width = options.size.width_px, height = options.size.height_px;
  camera.width_px = options.size.width_px;
  camera.height_px = options.size.height_px;
  camera.fx = camera.fy = options.focal_per_width * width;
  camera.cx = (width - 1) / 2 + dice->Between(-1, 1) * options.principal_offset * width;
  camera.cy = (height - 1) / 2 + dice->Between(-1, 1) * options.principal_offset * width;
  camera.u0 = (width - 1) / 2 + dice->Between(-1, 1) * options.distortion_offset * width;
  camera.v0 = (height - 1) / 2 + dice->Between(-1, 1) * options.distortion_offset * width;
  const double corner2 = (width * width + height * height) / 4 / (camera.fx * camera.fx);
  camera.k1 = options.distortion_at_corner / corner2;
  camera.k2 = options.distortion_at_corner * options.second_share / (corner2 * corner2);
  return camera;
}

// From `distance` away at a tilt, looking at `target` on the floor, the camera turned about its
// axis by `roll`.
Rigid3 LookAt(const Eigen::Vector3d& target, double distance, double tilt, double azimuth,
              double roll) {
  const Eigen::Vector3d away(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                             std::cos(tilt));
  const Eigen::Vector3d z = -away;
  const Eigen::Vector3d x = Eigen::Vector3d(-std::sin(azimuth), std::cos(azimuth), 0);
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  cam_from_world =
      Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix() * cam_from_world;
  const Eigen::Vector3d center = target + distance * away;
  return {Eigen::Quaterniond(cam_from_world), -(cam_from_world * center)};
}

}  // namespace

SyntheticSession MakeSession(const SessionOptions& options) {
  SyntheticSession session;
  Dice dice(options.seed);
  session.points = LayOutSheets(options, &dice);
  SessionOptions milder = options;
  for (session.truth = MakeCamera(options, &dice);
       !CheckCamera(session.truth).ok();) {  // the lens would fold over
    milder.distortion_at_corner *= 0.95;
    session.truth = MakeCamera(milder, &dice);
  }
  for (uint32_t photo = 0; photo < options.photo_count; ++photo) {
    ViewObservations view;
    view.name = "photo" + std::to_string(photo + 1);
    view.size = options.size;
    // The nearest shows about 0.8 m across.
    const double distance =
        0.8 * options.focal_per_width * std::pow(options.distance_ratio, dice.Between(0, 1));
    const Eigen::Vector3d target(dice.Between(-0.2, 0.2), dice.Between(-0.25, 0.25), 0);
    const double azimuth =
        2 * std::numbers::pi * (photo + dice.Between(-0.3, 0.3)) / options.photo_count;
    const double tilt = dice.Between(options.tilt_deg_min, options.tilt_deg_max) * kRadPerDeg;
    const double roll = (90 * (photo % 4) + dice.Between(-20, 20)) * kRadPerDeg;
    const Rigid3 pose = LookAt(target, distance, tilt, azimuth, roll);
    for (uint32_t id = 0; id < session.points.size(); ++id) {
      const auto undistorted = PixelFromBearing(session.truth, pose * session.points[id]);
      const bool is_missed = dice.Between(0, 1) < options.missed_share;
      const Eigen::Vector2d noise =
          options.noise_px * Eigen::Vector2d(dice.Gaussian(), dice.Gaussian());
      if (!undistorted || is_missed) continue;
      // Only what lies before the fold of the distortion: what lies far outside of the photo could
      // be folded back into it.
      const Eigen::Vector2d px = DistortPixel(session.truth, *undistorted);
      const auto back = UndistortPixel(session.truth, px);
      if (!back || (*back - *undistorted).norm() > 1e-3) continue;
      constexpr double kMargin = 8;  // px; a marker at the very edge is cut and not found
      if (px.x() < kMargin || px.y() < kMargin || px.x() > options.size.width_px - 1 - kMargin ||
          px.y() > options.size.height_px - 1 - kMargin) {
        continue;
      }
      view.points.push_back({id, px + noise, options.noise_px});
    }
    session.cams_from_world.push_back(pose);
    session.input.views.push_back(std::move(view));
  }
  return session;
}

SessionOptions ExperimentOptions(uint32_t index) {
  Dice dice(MixSeed(0x5e55, index));
  constexpr std::array<ImageSize, 3> kSizes = {{{1600, 1200}, {2272, 1704}, {3000, 2000}}};
  SessionOptions options;
  options.size = kSizes[index % kSizes.size()];
  options.focal_per_width = 0.6 * std::pow(2.5 / 0.6, dice.Between(0, 1));
  options.photo_count = 8 + dice.Below(13);
  const double strength = dice.Between(0.01, 0.12);  // a strong lens is a wide one
  options.distortion_at_corner =
      (dice.Below(4) == 0 ? 0.5 : -1) * strength * std::min(1.0, 1 / options.focal_per_width);
  options.second_share = dice.Between(-0.5, 0.1);
  options.noise_px = 0.05 * std::pow(6, dice.Between(0, 1));
  options.seed = MixSeed(0xca11b, index);
  return options;
}

SyntheticSession MakePoorSession(uint32_t index) {
  Dice dice(MixSeed(0x9002, index));
  SessionOptions options = ExperimentOptions(1000 + index);
  options.photo_count = 3 + dice.Below(8);
  options.tilt_deg_min = 0;
  options.tilt_deg_max = dice.Between(0.5, 25);
  options.distance_ratio = dice.Between(1, 1.5);
  options.noise_px *= dice.Between(1, 4);
  options.missed_share = dice.Between(0.1, 0.7);
  options.sheet_height_mm = dice.Between(0, 6);
  SyntheticSession session = MakeSession(options);
  const bool are_ids_misread = dice.Below(2) == 0, has_sheet_moved = dice.Below(3) == 0;
  const uint32_t sheet = dice.Below(16), from = dice.Below(options.photo_count);
  const Eigen::Vector2d move(dice.Between(-40, 40), dice.Between(-40, 40));
  for (uint32_t v = 0; v < options.photo_count; ++v) {
    for (PointObservation& p : session.input.views[v].points) {
      if (are_ids_misread && dice.Below(30) == 0) p.id = dice.Below(96);
      if (has_sheet_moved && v >= from && p.id / 6 == sheet) p.px += move;
    }
  }
  return session;
}

double LargestDistortionError(const CameraModel& model, const CameraModel& truth) {
  double largest = 0;
  for (int row = 0; row <= 12; ++row) {
    for (int column = 0; column <= 16; ++column) {
      const Eigen::Vector2d px(column * (truth.width_px - 1.0) / 16,
                               row * (truth.height_px - 1.0) / 12);
      const auto ours = UndistortPixel(model, px), theirs = UndistortPixel(truth, px);
      if (!ours || !theirs) return std::numeric_limits<double>::infinity();
      largest = std::max(largest, (*ours - *theirs).norm());
    }
  }
  return largest;
}

}  // namespace veduta
