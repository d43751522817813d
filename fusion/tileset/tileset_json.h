// SPDX-License-Identifier: Apache-2.0
#pragma once
// A tile tree as the tileset.json of OGC 3D Tiles 1.1.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "fusion/tileset/tile_tree.h"

namespace veduta {

// Contents are "tiles/NAME.glb". Boxes, errors and contents are in the frame of the reconstruction;
// `earth_from_world`, if given, is the transform of the root, into metres about the earth's centre
// (EPSG:4978), and scales errors as the specification has it. Deterministic; O(nodes), about 250
// bytes for each. The tree must have nodes.
std::string TilesetJson(const TileTree& tree,
                        const std::optional<Eigen::Matrix4d>& earth_from_world);

}  // namespace veduta
