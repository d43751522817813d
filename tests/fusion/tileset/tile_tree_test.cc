// SPDX-License-Identifier: Apache-2.0
// Goal: a tile tree holds every tile once, from coarse to fine, and names what it is made of.
// Method: random tiles on all sides of the origin, and small trees by hand; the invariants of the
//   header on each node; trees that differ in one tile.
#include "fusion/tileset/tile_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "fusion/volume/grid.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr double kVoxel = 0.05;

std::vector<TileLeaf> RandomLeaves(uint32_t count, uint32_t extent, uint64_t seed) {
  SeededRandom random(seed);
  std::map<GridPlace, TileLeaf> leaves;
  const auto coordinate = [&] {
    return static_cast<int32_t>(random.Below(2 * extent)) - static_cast<int32_t>(extent);
  };
  for (uint32_t i = 0; i < count; ++i) {
    const GridPlace place = {coordinate(), coordinate(), coordinate()};
    leaves[place] = {place, std::max<uint64_t>(random.Next(), 1), random.Next()};
  }
  std::vector<TileLeaf> list;
  for (const auto& [place, leaf] : leaves) list.push_back(leaf);
  return list;
}

TileTree MakeTree(const std::vector<TileLeaf>& leaves) {
  auto tree = TileTree::Make(leaves, kVoxel);
  EXPECT_TRUE(tree.ok()) << tree.status().message();
  return *std::move(tree);
}

std::set<std::string> NamesOf(const TileTree& tree) {
  std::set<std::string> names;
  for (const TileNode& node : tree.nodes()) names.insert(TileName(node));
  return names;
}

TEST(TileTree, HoldsEveryTileOnceFromCoarseToFine) {
  for (const uint32_t extent : {1u, 2u, 5u, 70u}) {
    const std::vector<TileLeaf> leaves = RandomLeaves(300, extent, extent);
    const TileTree tree = MakeTree(leaves);
    const auto& nodes = tree.nodes();
    std::vector<int> parents(nodes.size());
    for (const TileNode& node : nodes) {
      EXPECT_EQ(node.children.empty(), node.level == 0);
      EXPECT_LE(node.children.size(), 8u);
      for (const uint32_t c : node.children) {
        ++parents[c];
        const TileNode& child = nodes[c];
        EXPECT_EQ(child.level + 1, node.level);
        EXPECT_LT(child.geometric_error, node.geometric_error);
        EXPECT_TRUE(node.box.contains(child.box));
      }
    }
    EXPECT_EQ(std::count(parents.begin(), parents.end() - 1, 1),
              static_cast<std::ptrdiff_t>(nodes.size() - 1));
    EXPECT_EQ(parents.back(), 0);
    for (size_t i = 0; i < leaves.size(); ++i) {
      EXPECT_EQ(nodes[i].place, leaves[i].place);
      EXPECT_EQ(nodes[i].geometric_error, 0);
    }
    EXPECT_EQ(NamesOf(tree).size(), nodes.size());
  }
}

TEST(TileTree, BoxesFollowTheBlocks) {
  const GridPlace place = {-1, 0, 2};
  // The blocks of number 0 (the lowest corner) and 63 (the highest): the whole tile and a voxel
  // around it.
  const auto whole = MakeTree({{place, 1ull << 63 | 1, 1}}).nodes()[0].box;
  const Eigen::Vector3d low(-64 - 0.5, -0.5, 128 - 0.5), high(1.5, 65.5, 193.5);
  EXPECT_LT((whole.min() - low * kVoxel).norm(), 1e-12);
  EXPECT_LT((whole.max() - high * kVoxel).norm(), 1e-12);
  const auto corner = MakeTree({{place, 2, 1}}).nodes()[0].box;  // one block, the second along x
  EXPECT_NEAR(corner.min().x(), (-48 - 0.5) * kVoxel, 1e-12);
  EXPECT_NEAR(corner.max().x(), (-32 + 1.5) * kVoxel, 1e-12);
  EXPECT_NEAR(corner.max().y(), 17.5 * kVoxel, 1e-12);
}

TEST(TileTree, OfOneTileOrNoneOrBothSidesOfTheOrigin) {
  EXPECT_TRUE(MakeTree({}).nodes().empty());
  EXPECT_EQ(MakeTree({{{7, -9, 3}, 1, 1}}).nodes().size(), 1u);
  const TileTree tree = MakeTree({{{-1, -1, -1}, 1, 1}, {{-1, 0, 0}, 1, 1}, {{0, 0, 0}, 1, 1}});
  ASSERT_EQ(tree.nodes().size(), 4u);
  EXPECT_EQ(tree.nodes().back().children.size(), 3u);
  EXPECT_EQ(tree.nodes().back().place, GridPlace());
}

TEST(TileTree, OneTileMoreOrChangedRenamesWhatIsAboveItAlone) {
  std::vector<TileLeaf> leaves = RandomLeaves(200, 8, 5);
  const TileTree before = MakeTree(leaves);
  EXPECT_EQ(NamesOf(before), NamesOf(MakeTree(leaves)));
  leaves[77].version ^= 1;
  const TileTree after = MakeTree(leaves);
  const uint32_t levels = before.nodes().back().level;
  const std::set<std::string> old_names = NamesOf(before), new_names = NamesOf(after);
  std::vector<std::string> fresh;
  std::ranges::set_difference(new_names, old_names, std::back_inserter(fresh));
  EXPECT_EQ(fresh.size(), levels + 1);
  leaves.erase(leaves.begin() + 77);
  fresh.clear();
  const std::set<std::string> fewer = NamesOf(MakeTree(leaves));
  std::ranges::set_difference(fewer, old_names, std::back_inserter(fresh));
  EXPECT_LE(fresh.size(), levels);
  // Another grid is another surface.
  EXPECT_NE(TileName(TileTree::Make(leaves, 2 * kVoxel)->nodes()[0]),
            TileName(MakeTree(leaves).nodes()[0]));
}

TEST(TileTree, NamesAreReadBackAndNothingElseIs) {
  const TileTree tree = MakeTree(RandomLeaves(50, 100, 9));
  for (const TileNode& node : tree.nodes()) {
    const auto parsed = ParseTileName(TileName(node));
    ASSERT_TRUE(parsed) << TileName(node);
    EXPECT_EQ(parsed->level, node.level);
    EXPECT_EQ(parsed->place, node.place);
    EXPECT_EQ(parsed->version, node.version);
  }
  for (const char* text :
       {"", "0", "0_1_2_3", "0_1_2_3_", "0_1_2_3_12", "0_1_2_3_00000000000000zz",
        "0_1_2_3_0123456789abcdef0", "0_1_2_3_0123456789ABCDEF", "00_1_2_3_0123456789abcdef",
        "0_+1_2_3_0123456789abcdef", "0_1_2_3_0123456789abcdef.glb", "-1_1_2_3_0123456789abcdef",
        "0_99999999999_2_3_0123456789abcdef", " 0_1_2_3_0123456789abcdef"}) {
    EXPECT_FALSE(ParseTileName(text)) << text;
  }
  EXPECT_TRUE(ParseTileName("0_1_-2_3_0123456789abcdef"));
  EXPECT_FALSE(ParseTileName(std::string(100'000, '1')));
}

TEST(TileTree, RefusesWhatIsNoGrid) {
  const auto code = [](const std::vector<TileLeaf>& leaves, double voxel_size) {
    return TileTree::Make(leaves, voxel_size).status().code();
  };
  const TileLeaf leaf = {{1, 2, 3}, 1, 1};
  for (const double size : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity()})
    EXPECT_EQ(code({leaf}, size), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({leaf, leaf}, kVoxel), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{{1, 2, 3}, 0, 1}}, kVoxel), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{{1 << 30, 2, 3}, 1, 1}}, kVoxel), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{{1, std::numeric_limits<int32_t>::min(), 3}, 1, 1}}, kVoxel),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
