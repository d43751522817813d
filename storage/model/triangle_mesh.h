// SPDX-License-Identifier: Apache-2.0
#pragma once
// A surface in memory.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace veduta {

struct TriangleMesh {
  std::vector<Eigen::Vector3f> positions;  // world frame of the reconstruction
  std::vector<Eigen::Vector3f>
      normals;  // unit, outward (towards the cameras); empty, or one for each position
  std::vector<std::array<uint8_t, 3>> colors;  // sRGB; empty, or one for each position
  std::vector<std::array<uint32_t, 3>>
      triangles;  // indices of positions, counter-clockwise seen from outside
};

}  // namespace veduta
