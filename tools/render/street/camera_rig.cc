// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/camera_rig.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "storage/base/angle.h"

namespace veduta::street {
namespace {

constexpr double kEyeM = 1.65;
constexpr double kAsideM = 2.0;  // from the middle of the road, away from the houses in view
constexpr double kSitesGapM =
    34.0;  // views up to 52 degrees off square reach 12 m of facade each way
constexpr double kStreetLengthMaxM = 400;

struct Station {
  Eigen::Vector2d at;
  double yaw_deg, pitch_deg;
};

double DirectionDeg(const Eigen::Vector2d& d) {
  return std::atan2(d.y(), d.x()) / kRadPerDeg;
}

// A station `along` a lane, looking to one side (+1 left, -1 right) at `yaw_deg` from the lane's
// direction.
Station OnLane(const Lane& lane, double along, double side, double yaw_deg) {
  const Eigen::Vector2d d = (lane.to - lane.from).normalized(), left(-d.y(), d.x());
  return {lane.from + along * d - side * kAsideM * left, DirectionDeg(d) + side * yaw_deg, 8};
}

// Views swing between along the street, where both rows are in sight, and nearly square on the
// facade: that ties the two rows and both walks together.
double SwingDeg(uint32_t k) {
  return 50 + 30 * std::cos(2 * M_PI * k / 8);
}

std::vector<Station> WalkStreets(const Plan& plan, uint32_t photos) {
  double total = 0;
  for (const Lane& lane : plan.lanes) total += 2 * (lane.to - lane.from).norm();
  const double spacing = total / photos;
  std::vector<Station> stations;
  double begin = 0;  // of the walk along this side of this lane
  for (const Lane& lane : plan.lanes) {
    const double length = (lane.to - lane.from).norm();
    for (const double side : {1.0, -1.0}) {
      while (stations.size() < photos && (stations.size() + 0.5) * spacing < begin + length) {
        const double walked = (stations.size() + 0.5) * spacing - begin;
        const uint32_t k = static_cast<uint32_t>(stations.size());
        stations.push_back(OnLane(lane, side > 0 ? walked : length - walked, side, SwingDeg(k)));
      }
      begin += length;
    }
  }
  while (stations.size() < photos)
    stations.push_back(OnLane(plan.lanes.back(), 0, -1, 50));  // rounding
  return stations;
}

// Around the ring's block counter-clockwise on a rectangle with round corners, looking to the
// right.
std::vector<Station> WalkLoop(const Plan& plan, uint32_t photos) {
  const double low = plan.lanes[0].from.x() + kAsideM, high = plan.lanes[0].to.x() - kAsideM,
               radius = 4;
  const double straight = high - low - 2 * radius, arc = M_PI / 2 * radius, side = straight + arc;
  std::vector<Station> stations;
  for (uint32_t k = 0; k < photos; ++k) {
    const double walked = 4 * side * k / photos;
    const int edge = std::min(3, static_cast<int>(walked / side));
    const double rest = walked - edge * side;
    // On the first edge, heading for +x; the others are turned.
    const double angle = rest < straight ? 0 : (rest - straight) / radius;
    const Eigen::Vector2d local = rest < straight
                                      ? Eigen::Vector2d(low + radius + rest, low)
                                      : Eigen::Vector2d(high - radius + radius * std::sin(angle),
                                                        low + radius - radius * std::cos(angle));
    const Eigen::Vector2d middle = Eigen::Vector2d::Constant((low + high) / 2);
    const Eigen::Vector2d at = middle + Eigen::Rotation2Dd(edge * M_PI / 2) * (local - middle);
    const double heading = edge * 90.0 + angle / kRadPerDeg;
    stations.push_back({at, heading - 90 + 15 * std::cos(2 * M_PI * k / 6), 8});
  }
  return stations;
}

std::vector<Station> WalkOrbit(const Plan& plan, uint32_t photos) {
  std::vector<Station> stations;
  for (uint32_t k = 0; k < photos; ++k) {
    const double angle = 2 * M_PI * k / photos;
    const Eigen::Vector2d at =
        plan.lanes[0].from.x() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    stations.push_back({at, angle / kRadPerDeg + 180, 10});
  }
  return stations;
}

std::vector<Station> WalkTwoSites(const Plan& plan, uint32_t photos, bool bridge) {
  const Lane& lane = plan.lanes[0];
  const double length = (lane.to - lane.from).norm();
  const double gap = std::max(kSitesGapM, 0.28 * length), site = (length - gap) / 2;
  const uint32_t bridging = bridge ? static_cast<uint32_t>(std::lround(photos * gap / length)) : 0;
  const uint32_t first = (photos - bridging + 1) / 2, second = photos - bridging - first;
  std::vector<Station> stations;
  const auto walk = [&](double from, double to, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k) {
      stations.push_back(OnLane(lane, from + (to - from) * (k + 0.5) / count, 1,
                                90 + 20 * std::cos(M_PI * k / 3)));
    }
  };
  walk(0, site, first);
  walk(site + gap, length, second);
  walk(site, site + gap, bridging);
  return stations;
}

}  // namespace

Status RigOptions::Check() const {
  VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
  if (photos < 1 || photos > 1'000'000) {
    return Status::InvalidArgument("number of photos " + std::to_string(photos) +
                                   " is outside [1, 1000000]");
  }
  if (!(position_jitter_m >= 0 && position_jitter_m <= 0.5)) {
    return Status::InvalidArgument("position jitter " + std::to_string(position_jitter_m) +
                                   " m is outside [0, 0.5]");
  }
  if (!(angle_jitter_deg >= 0 && angle_jitter_deg <= 20)) {
    return Status::InvalidArgument("angle jitter " + std::to_string(angle_jitter_deg) +
                                   " degrees is outside [0, 20]");
  }
  return {};
}

Rigid3 LookFrom(const Eigen::Vector3d& center, double yaw_deg, double pitch_deg, double roll_deg) {
  const double yaw = yaw_deg * kRadPerDeg, pitch = pitch_deg * kRadPerDeg;
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                std::sin(pitch));
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rows;
  rows << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  const Eigen::Matrix3d roll =
      Eigen::AngleAxisd(-roll_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Rigid3 cam_from_world;
  cam_from_world.rotation = Eigen::Quaterniond(roll * rows).normalized();
  cam_from_world.translation = -(cam_from_world.rotation * center);
  return cam_from_world;
}

SceneOptions SceneForTrajectory(Trajectory trajectory, uint32_t photos, double length_m) {
  SceneOptions scene;
  switch (trajectory) {
    case Trajectory::kStreet:
      scene.length_m = length_m > 0 ? length_m : std::max(20.0, photos / 1.2);
      scene.layout = scene.length_m > kStreetLengthMaxM ? Layout::kGrid : Layout::kStreet;
      break;
    case Trajectory::kLoop:
      scene.length_m = length_m > 0 ? length_m : std::max(100.0, photos * 1.2);
      scene.layout = Layout::kRing;
      break;
    case Trajectory::kOrbit:
      scene.length_m = length_m > 0 ? length_m : 107;
      scene.layout = Layout::kSquare;
      break;
    case Trajectory::kTwoSites:
      scene.length_m = length_m > 0 ? length_m : std::max(70.0, photos * 1.3);
      scene.layout = Layout::kStreet;
      break;
  }
  return scene;
}

Result<std::vector<StreetCamera>> MakeCameras(const SceneOptions& scene,
                                              const RigOptions& options) {
  VEDUTA_RETURN_IF_ERROR(scene.Check());
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const Plan plan = MakePlan(scene);
  const bool streets = scene.layout == Layout::kStreet || scene.layout == Layout::kGrid;
  std::vector<Station> stations;
  if (options.trajectory == Trajectory::kStreet && streets) {
    stations = WalkStreets(plan, options.photos);
  } else if (options.trajectory == Trajectory::kLoop && scene.layout == Layout::kRing) {
    stations = WalkLoop(plan, options.photos);
  } else if (options.trajectory == Trajectory::kOrbit && scene.layout == Layout::kSquare) {
    stations = WalkOrbit(plan, options.photos);
  } else if (options.trajectory == Trajectory::kTwoSites && scene.layout == Layout::kStreet) {
    if (scene.length_m < 1.5 * kSitesGapM) {
      return Status::InvalidArgument("two sites need a street of at least " +
                                     std::to_string(1.5 * kSitesGapM) + " m, not " +
                                     std::to_string(scene.length_m));
    }
    stations = WalkTwoSites(plan, options.photos, options.bridge);
  } else {
    return Status::InvalidArgument(
        "the trajectory does not suit the scene's layout; use SceneForTrajectory");
  }
  SeededRandom random(MixSeed(options.seed, 0xCA3E7A));
  const auto jitter = [&](double amplitude) { return amplitude * (2 * random.Unit() - 1); };
  std::vector<StreetCamera> cameras;
  for (const Station& s : stations) {
    const double move = options.position_jitter_m, turn = options.angle_jitter_deg;
    const double z = kEyeM + jitter(0.7 * move), y = s.at.y() + jitter(move);
    const Eigen::Vector3d center(s.at.x() + jitter(move), y, z);
    const double yaw = s.yaw_deg + jitter(turn), pitch = s.pitch_deg + jitter(turn),
                 roll = jitter(turn);
    cameras.push_back({"", options.model, LookFrom(center, yaw, pitch, roll)});
  }
  if (options.shuffle) {
    for (size_t i = cameras.size(); i > 1; --i) std::swap(cameras[i - 1], cameras[random.Below(i)]);
  }
  const int digits = std::max(4, static_cast<int>(std::to_string(cameras.size()).size()));
  for (size_t i = 0; i < cameras.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    cameras[i].name = "photo" + std::string(digits - number.size(), '0') + number + ".jpg";
  }
  return cameras;
}

}  // namespace veduta::street
