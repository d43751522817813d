// SPDX-License-Identifier: Apache-2.0
#pragma once
// Colours for what no photo sees.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "storage/model/triangle_mesh.h"

namespace veduta {

// Ring after ring, gives every vertex without a colour the mean light of its neighbours (by an
// edge) that had one before the ring. light, is_known: one for each vertex; is_known becomes true
// for what was filled. At most `rings_max` rings. Deterministic. O(vertices + triangles).
void FillColors(const TriangleMesh& mesh, uint32_t rings_max, std::vector<Eigen::Vector3f>* light,
                std::vector<uint8_t>* is_known);

}  // namespace veduta
