// SPDX-License-Identifier: Apache-2.0
#include "fusion/tileset/tileset_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace veduta {
namespace {

using Json = nlohmann::json;

// Its middle, then its half axes.
Json BoxJson(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d middle = box.center(), half = box.sizes() / 2;
  return {{"box",
           {middle.x(), middle.y(), middle.z(), half.x(), 0, 0, 0, half.y(), 0, 0, 0, half.z()}}};
}

Json NodeJson(const TileTree& tree, const TileNode& node) {
  Json json = {{"boundingVolume", BoxJson(node.box)},
               {"geometricError", node.geometric_error},
               {"content", {{"uri", "tiles/" + TileName(node) + ".glb"}}}};
  for (const uint32_t child : node.children)
    json["children"].push_back(NodeJson(tree, tree.nodes()[child]));
  return json;
}

}  // namespace

std::string TilesetJson(const TileTree& tree,
                        const std::optional<Eigen::Matrix4d>& earth_from_world) {
  VEDUTA_CHECK(!tree.nodes().empty(), "a tileset needs a tile");
  const TileNode& node = tree.nodes().back();
  Json root = NodeJson(tree, node);
  root["refine"] = "REPLACE";
  double scale = 1;
  if (earth_from_world) {
    scale = earth_from_world->topLeftCorner<3, 3>().colwise().norm().maxCoeff();
    root["transform"] = Json::array();
    for (const double one : earth_from_world->reshaped()) root["transform"].push_back(one);
  }
  // Where none of it is drawn, all of it is missing.
  const double missing = std::max(node.box.diagonal().norm(), 2 * node.geometric_error);
  const Json tileset = {{"asset", {{"version", "1.1"}, {"generator", "Veduta"}}},
                        {"geometricError", missing * scale},
                        {"root", std::move(root)}};
  return tileset.dump();
}

}  // namespace veduta
