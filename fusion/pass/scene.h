// SPDX-License-Identifier: Apache-2.0
#pragma once
// One reconstruction's photos, poses and points in memory, as the dense pass reads them.

#include <map>
#include <vector>

#include "storage/database.h"

namespace veduta {

struct SceneObservation {
  uint32_t point = 0;  // index into Scene::points
  FeatureIndex feature = 0;
};

struct SceneImage {
  ImageRecord record;
  CameraModel camera;
  Rigid3 cam_from_world;
  std::vector<SceneObservation> observations;  // ascending points
};

struct ScenePoint {
  PointId id;
  Eigen::Vector3d position;    // world
  std::vector<ImageId> track;  // ascending
};

struct Scene {
  ReconstructionRecord reconstruction;
  std::map<ImageId, SceneImage> images;
  std::vector<ScenePoint> points;
};

// kNotFound when there is no such reconstruction; kInvalidArgument, naming the other, when it was
// merged into another. Some 100 bytes a point and 8 an observation.
Result<Scene> LoadScene(const Snapshot& snapshot, ReconstructionId reconstruction);

}  // namespace veduta
