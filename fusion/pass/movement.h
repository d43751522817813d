// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far adjustments have moved what an artefact was made from: little enough, and it stays.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fusion/pass/scene.h"
#include "storage/model/pinhole.h"

namespace veduta {

// Where the points that an image sees lie in its camera frame now; at most 500 of them, spread over
// all.
std::vector<Eigen::Vector3d> PointsInCamera(const Scene& scene, const SceneImage& image);

// 90 % of the points, given in the key view's camera frame, move no further in a sensor view (px of
// `sensor`) between its two poses relative to the key view. Infinite where a point comes to lie
// behind it; 0 without points.
double MovedPx(std::span<const Eigen::Vector3d> points, const Pinhole& sensor,
               const Rigid3& sensor_from_key_then, const Rigid3& sensor_from_key_now);

// 90 % of the points move no further in the world (world units) between two poses of the camera.
double MovedInWorld(std::span<const Eigen::Vector3d> points, const Rigid3& cam_from_world_then,
                    const Rigid3& cam_from_world_now);

}  // namespace veduta
