// SPDX-License-Identifier: Apache-2.0
#pragma once
// A scene of known truth for the mapping tests: points in a box (or on a plane) before cameras on
// an arc, each point with a descriptor of its own, seen with Gaussian noise.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"
#include "storage/base/content_hash.h"
#include "storage/base/transform.h"
#include "storage/model/pair.h"

namespace veduta {

struct SceneOptions {
  uint32_t camera_count = 6, point_count = 300;
  double noise_px = 0.3;
  double arc_deg = 40;    // over which the cameras are spread
  double forward = 0;     // [0, 1]: share of their distance by which they come nearer on the way
  bool planar = false;    // all points on one slanted plane
  bool rotation = false;  // all cameras in one place
  // > 0: the second half of the cameras, and of the points, stands so far to the right of the rest,
  // and only these few points between the two sides are seen from both.
  double beside = 0;
  uint32_t seam_point_count = 15;
  // Whether the points stand on the four walls of a room, 24 wide and taking turns. Each wall has
  // equally many cameras one after the other: in a row before it, and the last two look at the
  // corner to the next wall.
  bool room = false;
  // > 1: the points stand in so many columns side by side that are all alike, and each view of a
  // descriptor differs a little from the others.
  uint32_t repeats = 1;
  uint64_t seed = 1;
};

struct SyntheticScene {
  static constexpr int kWidth = 1000, kHeight = 800;
  Pinhole camera;
  std::vector<Rigid3> poses;  // cam_from_world
  std::vector<Eigen::Vector3d> points;
  // Ids from 1, reconstruction 1; feature i of image k is points[seen[k][i]].
  std::vector<MapImage> images;
  std::vector<std::vector<uint32_t>> seen;
  std::vector<std::vector<int>> feature_of;  // [camera][point], -1 where it is not seen

  // Matches of all points that both cameras see.
  PairRecord Pair(uint32_t i, uint32_t j) const {
    PairRecord pair;
    pair.a = images[i].id;
    pair.b = images[j].id;
    pair.b_from_a = poses[j] * poses[i].Inverse();
    pair.b_from_a.translation.normalize();
    for (uint32_t f = 0; f < seen[i].size(); ++f) {
      const int g = feature_of[j][seen[i][f]];
      if (g >= 0) pair.matches.push_back({f, static_cast<FeatureIndex>(g)});
    }
    return pair;
  }
};

inline double Gaussian(SeededRandom& random) {  // Box and Muller
  return std::sqrt(-2 * std::log(1 - random.Unit())) * std::cos(6.283185307179586 * random.Unit());
}

// cam_from_world of camera `index` on the arc, which looks at the middle of the points.
inline Rigid3 PoseOnArc(const SceneOptions& options, uint32_t index) {
  const double turn = options.camera_count > 1 ? index / (options.camera_count - 1.0) - 0.5 : 0;
  const double angle = options.arc_deg * turn * 0.017453292519943295;
  const Eigen::Matrix3d look =
      Eigen::AngleAxisd(options.rotation ? 0.3 * angle : angle, Eigen::Vector3d::UnitY())
          .toRotationMatrix();
  const Eigen::Vector3d center =
      options.rotation
          ? Eigen::Vector3d(0, 0, -8)
          : Eigen::Vector3d(look * Eigen::Vector3d(0, 0, -8 * (1 - options.forward * turn)) +
                            Eigen::Vector3d(0, 0.2 * turn, 0));
  Rigid3 pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(look.transpose()));
  pose.translation = -(pose.rotation * center);
  return pose;
}

// wall_from_room: a wall as it would be alone, its points about the origin.
inline Rigid3 WallFromRoom(uint32_t wall) {
  constexpr double kRightAngle = 1.5707963267948966;
  Rigid3 wall_from_room;
  wall_from_room.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-kRightAngle * wall, Eigen::Vector3d::UnitY()));
  wall_from_room.translation = Eigen::Vector3d(0, 0, -12);
  return wall_from_room;
}

inline Rigid3 PoseInRoom(const SceneOptions& options, uint32_t index) {
  const uint32_t of_wall = options.camera_count / 4, in_row = of_wall - 2, k = index % of_wall;
  Eigen::Vector3d center(-6 + 12.0 * k / (in_row - 1), 0.2 * (k % 2), -8);
  double angle = 0;
  if (k >= in_row) center.x() = k == in_row ? 6.5 : 5.5, angle = 0.7853981633974483;
  Rigid3 cam_from_wall;
  cam_from_wall.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
  cam_from_wall.translation = -(cam_from_wall.rotation * center);
  return cam_from_wall * WallFromRoom(index / of_wall);
}

// The two sides of a scene each have their cameras on an arc of their own.
inline Rigid3 PoseInScene(const SceneOptions& options, uint32_t index) {
  if (options.room) return PoseInRoom(options, index);
  if (options.beside == 0) return PoseOnArc(options, index);
  SceneOptions side = options;
  side.camera_count = options.camera_count / 2;
  Rigid3 pose = PoseOnArc(side, index % side.camera_count);
  if (index >= side.camera_count)
    pose.translation -= pose.rotation * Eigen::Vector3d(options.beside, 0, 0);
  return pose;
}

// Where a point of a scene of two sides lies: those of the seam come last.
inline Eigen::Vector3d BesidePoint(const SceneOptions& options, uint32_t index,
                                   Eigen::Vector3d point) {
  if (options.beside == 0) return point;
  const uint32_t sides_count = options.point_count - options.seam_point_count;
  if (index >= sides_count) return {options.beside / 2 + 0.1 * point.x(), point.y(), point.z()};
  point.x() *= 0.8;
  if (index % 2 == 1) point.x() += options.beside;
  return point;
}

inline Eigen::Vector3d RoomPoint(const SceneOptions& options, uint32_t index,
                                 Eigen::Vector3d point) {
  if (!options.room) return point;
  point.x() *= 4;
  return WallFromRoom(index % 4).Inverse() * point;
}

// Makes all columns like the first one: their points, and the descriptors of these.
inline void RepeatColumns(const SceneOptions& options, std::vector<Eigen::Vector3d>* points,
                          std::vector<std::vector<uint8_t>>* descriptors) {
  const uint32_t in_column = options.point_count / options.repeats;
  const double width = 6.0 / options.repeats;
  for (uint32_t i = 0; i < options.point_count; ++i) {
    const uint32_t column = std::min(i / in_column, options.repeats - 1);
    Eigen::Vector3d& point = (*points)[i];
    if (column == 0) {
      point.x() = -3 + (point.x() + 3) / options.repeats;
    } else {
      point = (*points)[i % in_column];
      point.x() += width * column;
      (*descriptors)[i] = (*descriptors)[i % in_column];
    }
    if (options.planar) point.z() = 0.3 * point.x();
  }
}

inline void AppendDescriptor(const SceneOptions& options, const std::vector<uint8_t>& descriptor,
                             SeededRandom& random, std::vector<uint8_t>* descriptors) {
  for (const uint8_t byte : descriptor)
    descriptors->push_back(options.repeats > 1 ? byte + static_cast<uint8_t>(random.Below(5))
                                               : byte);
}

inline SyntheticScene MakeScene(const SceneOptions& options) {
  SyntheticScene scene;
  scene.camera.fx = scene.camera.fy = 900;
  scene.camera.cx = 500;
  scene.camera.cy = 400;
  SeededRandom random(options.seed);
  std::vector<std::vector<uint8_t>> descriptors;
  for (uint32_t i = 0; i < options.point_count; ++i) {
    Eigen::Vector3d p{6 * random.Unit() - 3, 4 * random.Unit() - 2, 3 * random.Unit() - 1.5};
    if (options.planar) p.z() = 0.3 * p.x();
    p = RoomPoint(options, i, BesidePoint(options, i, p));
    scene.points.push_back(p);
    std::vector<uint8_t> descriptor(kDescriptorSize);
    for (uint8_t& byte : descriptor) byte = static_cast<uint8_t>(random.Below(90));
    descriptors.push_back(std::move(descriptor));
  }
  if (options.repeats > 1) RepeatColumns(options, &scene.points, &descriptors);
  for (uint32_t k = 0; k < options.camera_count; ++k) {
    const Rigid3 pose = PoseInScene(options, k);
    scene.poses.push_back(pose);

    auto features = std::make_shared<Features>();
    scene.seen.emplace_back();
    scene.feature_of.emplace_back(options.point_count, -1);
    for (uint32_t i = 0; i < options.point_count; ++i) {
      const Eigen::Vector3d x_cam = pose * scene.points[i];
      if (!(x_cam.z() > 0)) continue;
      const Eigen::Vector2d x = scene.camera.Project(x_cam);
      if (x.x() < 0 || x.y() < 0 || x.x() >= scene.kWidth || x.y() >= scene.kHeight) continue;
      Keypoint keypoint;
      keypoint.x_px = static_cast<float>(x.x() + options.noise_px * Gaussian(random));
      keypoint.y_px = static_cast<float>(x.y() + options.noise_px * Gaussian(random));
      keypoint.scale_px = 2;
      keypoint.contrast_sign = i % 2 ? 1 : -1;
      scene.feature_of[k][i] = static_cast<int>(features->keypoints.size());
      scene.seen[k].push_back(i);
      features->keypoints.push_back(keypoint);
      AppendDescriptor(options, descriptors[i], random, &features->descriptors);
    }
    MapImage image;
    image.id = ImageId(k + 1);
    image.reconstruction = ReconstructionId(1);
    image.cam_from_world = pose;
    image.camera = scene.camera;
    image.width_px = scene.kWidth;
    image.height_px = scene.kHeight;
    image.points.resize(features->size());
    image.grid = std::make_shared<const FeatureGrid>(*features);
    image.features = std::move(features);
    scene.images.push_back(std::move(image));
  }
  return scene;
}

// All cameras placed at the truth, all points seen by at least two.
inline CityMap MakeMap(const SyntheticScene& scene) {
  CityMap map;
  for (const MapImage& image : scene.images) map.PlaceImage(image);
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    std::vector<TrackElement> track;
    for (uint32_t k = 0; k < scene.images.size(); ++k) {
      if (scene.feature_of[k][i] >= 0)
        track.push_back({scene.images[k].id, static_cast<FeatureIndex>(scene.feature_of[k][i])});
    }
    if (track.size() >= 2) map.AddPoint(track.front().image, scene.points[i], track);
  }
  return map;
}

inline double RotationErrorDeg(const Rigid3& a, const Rigid3& b) {
  return a.rotation.angularDistance(b.rotation) * 57.29577951308232;
}

}  // namespace veduta
