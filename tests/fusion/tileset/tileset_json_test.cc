// SPDX-License-Identifier: Apache-2.0
// Goal: a tile tree becomes a tileset.json of 3D Tiles 1.1.
// Method: the text is parsed and held against the tree, node by node, with and without a place on
//   the earth.
#include "fusion/tileset/tileset_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace veduta {
namespace {

using Json = nlohmann::json;

TileTree SmallTree() {
  const std::vector<TileLeaf> leaves = {
      {{-3, 0, 0}, ~0ull, 1}, {{0, 0, 0}, 1, 2}, {{0, 0, 1}, 6, 3}, {{2, 1, 0}, 1, 4}};
  return *TileTree::Make(leaves, 0.1);
}

size_t CheckNode(const TileTree& tree, const TileNode& node, const Json& json) {
  EXPECT_EQ(json["content"]["uri"], "tiles/" + TileName(node) + ".glb");
  EXPECT_EQ(json["geometricError"], node.geometric_error);
  const auto& box = json["boundingVolume"]["box"];
  EXPECT_EQ(box.size(), 12u);
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box[3 + 4 * axis];
    EXPECT_NEAR(box[axis].get<double>() - half, node.box.min()[axis], 1e-9);
    EXPECT_NEAR(box[axis].get<double>() + half, node.box.max()[axis], 1e-9);
  }
  EXPECT_EQ(json.contains("children"), !node.children.empty());
  size_t count = 1;
  for (size_t i = 0; i < node.children.size(); ++i)
    count += CheckNode(tree, tree.nodes()[node.children[i]], json["children"][i]);
  return count;
}

TEST(TilesetJson, HasTheTree) {
  const TileTree tree = SmallTree();
  const std::string text = TilesetJson(tree, std::nullopt);
  const Json json = Json::parse(text);
  EXPECT_EQ(json["asset"]["version"], "1.1");
  EXPECT_EQ(json["root"]["refine"], "REPLACE");
  EXPECT_FALSE(json["root"].contains("transform"));
  EXPECT_GT(json["geometricError"].get<double>(), json["root"]["geometricError"].get<double>());
  EXPECT_EQ(CheckNode(tree, tree.nodes().back(), json["root"]), tree.nodes().size());
  EXPECT_EQ(TilesetJson(SmallTree(), std::nullopt), text);
}

TEST(TilesetJson, StandsOnTheEarthByTheTransformOfTheRoot) {
  Eigen::Matrix4d place = Eigen::Matrix4d::Identity();
  place.topLeftCorner<3, 3>() *= 20;
  place(0, 3) = 4e6;
  const Json json = Json::parse(TilesetJson(SmallTree(), place));
  const auto& transform = json["root"]["transform"];
  ASSERT_EQ(transform.size(), 16u);
  EXPECT_EQ(transform[0], 20);
  EXPECT_EQ(transform[12], 4e6);  // column by column
  EXPECT_EQ(transform[15], 1);
  const Json local = Json::parse(TilesetJson(SmallTree(), std::nullopt));
  EXPECT_EQ(json["root"]["geometricError"], local["root"]["geometricError"]);
  EXPECT_NEAR(json["geometricError"].get<double>(), 20 * local["geometricError"].get<double>(),
              1e-9);
}

}  // namespace
}  // namespace veduta
