// SPDX-License-Identifier: Apache-2.0
#include "fusion/tileset/tile_tree.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

#include "fusion/volume/grid.h"
#include "storage/base/content_feed.h"

namespace veduta {
namespace {

constexpr int32_t kTileCoordinateMax = kBlockCoordinateMax / kTileBlocks;
// Longer names are none: of a level, three coordinates and a version, with their signs.
constexpr size_t kNameLengthMax = 64;

Eigen::Vector3d CornerOf(const GridPlace& block) {
  return Eigen::Vector3d(block.x, block.y, block.z) * kBlockSide;
}

// Of the allocated blocks' cells. A cell belongs to the block of its lowest voxel and reaches to
// the next voxel; one whose lowest voxel nobody saw may be drawn as well (extraction.h), next to
// these blocks: hence one voxel more.
Eigen::AlignedBox3d BoxOf(const TileLeaf& leaf, double voxel_size) {
  Eigen::AlignedBox3d box;
  const GridPlace first = FirstBlock(leaf.place);
  for (int32_t i = 0; i < kTileBlocks * kTileBlocks * kTileBlocks; ++i) {
    if (!(leaf.blocks >> i & 1)) continue;
    const GridPlace block = {first.x + i % kTileBlocks, first.y + i / kTileBlocks % kTileBlocks,
                             first.z + i / (kTileBlocks * kTileBlocks)};
    const Eigen::Vector3d low = CornerOf(block);
    box.extend(low - Eigen::Vector3d::Ones());
    box.extend(low + Eigen::Vector3d::Constant(kBlockSide + 1));
  }
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5);  // from corners to middles of voxels
  return {(box.min() + half) * voxel_size, (box.max() + half) * voxel_size};
}

Status CheckLeaves(std::span<const TileLeaf> leaves) {
  for (size_t i = 0; i < leaves.size(); ++i) {
    const GridPlace& place = leaves[i].place;
    const auto wrong = [&](const char* what) {
      return Status::InvalidArgument("the tile at " + std::to_string(place.x) + " " +
                                     std::to_string(place.y) + " " + std::to_string(place.z) +
                                     what);
    };
    for (const int32_t at : {place.x, place.y, place.z}) {
      if (at <= -kTileCoordinateMax || at >= kTileCoordinateMax)
        return wrong(" is outside of every grid");
    }
    if (leaves[i].blocks == 0) return wrong(" has no blocks");
    if (i > 0 && !(leaves[i - 1].place < place)) return wrong(" is out of order");
  }
  return Status::Ok();
}

GridPlace ParentOf(const GridPlace& place) {
  return {FloorDivide(place.x, 2), FloorDivide(place.y, 2), FloorDivide(place.z, 2)};
}

bool IsAtOrigin(const GridPlace& place) {
  const auto is_near = [](int32_t at) { return at == -1 || at == 0; };
  return is_near(place.x) && is_near(place.y) && is_near(place.z);
}

uint64_t VersionOf(const TileNode& node, const std::vector<TileNode>& nodes) {
  ContentFeed feed;
  feed << std::string("node") << kTilesetVersion << node.level;
  for (const uint32_t child : node.children) feed << nodes[child].version;
  return feed.Finish().Seed();
}

}  // namespace

uint64_t LeafVersion(const TileLeaf& leaf, double voxel_size) {
  ContentFeed feed;
  feed << std::string("leaf") << kTilesetVersion << voxel_size << leaf.place.x << leaf.place.y
       << leaf.place.z << leaf.blocks << leaf.version;
  return feed.Finish().Seed();
}

Result<TileTree> TileTree::Make(std::span<const TileLeaf> leaves, double voxel_size) {
  if (!std::isfinite(voxel_size) || voxel_size <= 0) {
    return Status::InvalidArgument("the voxel size is " + std::to_string(voxel_size) +
                                   ", and must be positive");
  }
  VEDUTA_RETURN_IF_ERROR(CheckLeaves(leaves));
  TileTree tree;
  tree.voxel_size_ = voxel_size;
  std::vector<TileNode>& nodes = tree.nodes_;
  for (const TileLeaf& leaf : leaves) {
    nodes.push_back({0, leaf.place, LeafVersion(leaf, voxel_size), BoxOf(leaf, voxel_size), 0, {}});
  }
  for (size_t first = 0; nodes.size() - first > 1;) {  // of the level that has got no parents yet
    const size_t end = nodes.size();
    const bool is_last =
        std::all_of(nodes.begin() + static_cast<std::ptrdiff_t>(first), nodes.end(),
                    [](const TileNode& one) { return IsAtOrigin(one.place); });
    std::map<GridPlace, std::vector<uint32_t>> parents;
    for (size_t i = first; i < end; ++i) {
      parents[is_last ? GridPlace() : ParentOf(nodes[i].place)].push_back(static_cast<uint32_t>(i));
    }
    const uint32_t level = nodes[first].level + 1;
    for (auto& [place, children] : parents) {
      TileNode node{level, place, 0, {}, 0, std::move(children)};
      for (const uint32_t child : node.children) node.box.extend(nodes[child].box);
      node.geometric_error = std::numbers::sqrt3 * std::ldexp(voxel_size, static_cast<int>(level));
      node.version = VersionOf(node, nodes);
      nodes.push_back(std::move(node));
    }
    first = end;
  }
  return tree;
}

std::string TileName(const TileNode& node) {
  char version[17];
  std::snprintf(version, sizeof version, "%016llx", static_cast<unsigned long long>(node.version));
  return std::to_string(node.level) + "_" + std::to_string(node.place.x) + "_" +
         std::to_string(node.place.y) + "_" + std::to_string(node.place.z) + "_" + version;
}

std::optional<ParsedTileName> ParseTileName(const std::string& name) {
  if (name.size() > kNameLengthMax) return std::nullopt;
  ParsedTileName parsed;
  const char* at = name.data();
  const char* const end = at + name.size();
  const auto read = [&](auto* value, int base, bool is_last) {
    const auto [rest, error] = std::from_chars(at, end, *value, base);
    if (error != std::errc()) return false;
    at = rest;
    if (is_last) return at == end;
    return at != end && *at++ == '_';
  };
  const bool is_read = read(&parsed.level, 10, false) && read(&parsed.place.x, 10, false) &&
                       read(&parsed.place.y, 10, false) && read(&parsed.place.z, 10, false) &&
                       read(&parsed.version, 16, true);
  // One content has one name: no other spelling of it is taken.
  if (!is_read || TileName({parsed.level, parsed.place, parsed.version, {}, 0, {}}) != name)
    return std::nullopt;
  return parsed;
}

}  // namespace veduta
