// SPDX-License-Identifier: Apache-2.0
#pragma once
// Submaps as rigid bodies, and the places that hold them together.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/pinhole.h"

namespace veduta {

// A place as a camera of one submap sees it.
struct TieView {
  uint32_t submap = 0;
  ImageId image;          // whose camera it is
  Rigid3 cam_from_world;  // where the submap is now
  Pinhole camera;
  Eigen::Vector2d x_px;
};

// Two submaps, and how many points both see; ties are some of them.
struct SubmapPair {
  uint32_t a = 0, b = 0;
  uint64_t shared_points = 0;
};

struct RelaxationProblem {
  // One for each submap: about which it turns and grows, for numerical condition alone; the middle
  // of its cameras.
  std::vector<Eigen::Vector3d> centers;
  std::vector<uint32_t> first_view = {0};  // [ties + 1]
  std::vector<TieView> views;              // of tie 0, then of tie 1, and so on
  std::vector<SubmapPair> pairs;           // each two submaps once
};

}  // namespace veduta
