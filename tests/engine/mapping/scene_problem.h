// SPDX-License-Identifier: Apache-2.0
#pragma once
// The bundle problem of a synthetic scene, with all of its cameras and points.

#include <vector>

#include "engine/mapping/bundle_problem.h"
#include "synthetic_scene.h"

namespace veduta {

// All poses but the last one are free. What is seen lies in undistorted px.
inline BundleProblem ProblemOf(const SyntheticScene& scene) {
  const CityMap map = MakeMap(scene);
  BundleProblem problem;
  std::vector<ImageId> images;
  for (const auto& [id, image] : map.images()) {
    images.push_back(id);
    problem.cams_from_world.push_back(image.cam_from_world);
    problem.cameras.push_back(image.camera);
  }
  problem.free_count = static_cast<uint32_t>(images.size()) - 1;
  for (const PointId id : map.PointsSeenBy(images)) {
    problem.points.push_back(map.point(id).position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (const TrackElement& element : map.point(id).track) {
      const Sighting seen = map.image(element.image).ViewOf(element.feature);
      problem.observations.push_back({element.image.value - 1, seen.x_px});
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

}  // namespace veduta
