// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface_tiles.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "engine/earth/local_frame.h"
#include "engine/query/living.h"
#include "fusion/pass/surface_settings.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/surface/glb_tile.h"
#include "fusion/tileset/coarser_mesh.h"
#include "fusion/tileset/tile_tree.h"
#include "fusion/tileset/tileset_json.h"
#include "storage/base/content_feed.h"

namespace veduta {
namespace {

using SharedSurface = std::shared_ptr<const CoarseSurface>;

// Damages that are told of one content. Chosen by hand.
constexpr size_t kLeftOutMax = 20;

std::string NameOf(ReconstructionId id) {
  return "reconstruction " + std::to_string(id.value);
}

Status HasNoSurface(ReconstructionId id) {
  return Status::NotFound(NameOf(id) +
                          " has no surface yet: run 'veduta densify', or serve with '--dense'");
}

Status IsSuperseded(const std::string& name) {
  return Status::NotFound("there is no tile '" + name +
                          "', or not any more: ask for tileset.json again, it names those there "
                          "are");
}

// What is stored does not fit together: no argument of whoever asks is wrong.
Status AsDamage(const Status& status) {
  return status.code() == StatusCode::kInvalidArgument ? Status::Corruption(status.message())
                                                       : status;
}

// The versions of a tile's mesh and of its colours as one.
TileLeaf LeafOf(const TileRecord& tile) {
  ContentFeed feed;
  feed << tile.mesh_version << tile.color_version;
  return {tile.place, tile.blocks, feed.Finish().Seed()};
}

// The surface that readers see.
struct StoredSurface {
  TileRecords tiles;  // that have triangles
  TileTree tree;
};

Result<double> VoxelSize(const Snapshot& snapshot, ReconstructionId id) {
  VEDUTA_ASSIGN_OR_RETURN(const auto settings, snapshot.dense().FindSettings(id));
  if (!settings) return HasNoSurface(id);
  return settings->voxel_size;
}

Result<StoredSurface> LoadStoredSurface(const Snapshot& snapshot, ReconstructionId id) {
  VEDUTA_ASSIGN_OR_RETURN(const double voxel_size, VoxelSize(snapshot, id));
  StoredSurface surface;
  VEDUTA_ASSIGN_OR_RETURN(surface.tiles, LoadCurrentTiles(snapshot, id));
  std::erase_if(surface.tiles, [](const auto& tile) { return tile.second.triangle_count == 0; });
  if (surface.tiles.empty()) return HasNoSurface(id);
  std::vector<TileLeaf> leaves;
  for (const auto& [place, tile] : surface.tiles) leaves.push_back(LeafOf(tile));
  Result<TileTree> tree = TileTree::Make(leaves, voxel_size);
  if (!tree.ok()) return AsDamage(tree.status());
  surface.tree = *std::move(tree);
  return surface;
}

// Grey, and lighter where the surface looks along the z axis, so that its shape is seen.
std::vector<std::array<uint8_t, 3>> ClayColors(const TriangleMesh& mesh) {
  std::vector<std::array<uint8_t, 3>> colors(mesh.positions.size(), {128, 128, 128});
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    const float facing = std::clamp(std::abs(mesh.normals[i].z()), 0.f, 1.f);
    colors[i].fill(static_cast<uint8_t>(96 + std::lround(96 * facing)));
  }
  return colors;
}

// Without normals, with colours: grey ones where it has none yet.
Result<TriangleMesh> LoadLeaf(const Snapshot& snapshot, const TileRecord& tile) {
  VEDUTA_ASSIGN_OR_RETURN(TileSurface surface, LoadSurface(snapshot, tile));
  TriangleMesh mesh = MeshOf(std::move(surface));
  if (mesh.colors.empty()) mesh.colors = ClayColors(mesh);
  mesh.normals.clear();
  return mesh;
}

uint64_t BytesOf(const TriangleMesh& mesh) {
  return mesh.positions.size() * (sizeof mesh.positions[0] + sizeof mesh.colors[0]) +
         mesh.triangles.size() * sizeof mesh.triangles[0];
}

// The right to make what a key names. Whoever wants one that is taken waits until it is given back.
// Parents wait for children alone, so nobody waits for ever.
class MakingTurn final {
 public:
  MakingTurn(CoarseSurfaces* coarse, const std::string& key) : coarse_(*coarse), key_(key) {
    std::unique_lock lock(coarse_.mutex);
    coarse_.made.wait(lock, [&] { return coarse_.making.insert(key_).second; });
  }
  ~MakingTurn() {
    const std::lock_guard lock(coarse_.mutex);
    coarse_.making.erase(key_);
    coarse_.made.notify_all();
  }
  MakingTurn(const MakingTurn&) = delete;
  MakingTurn& operator=(const MakingTurn&) = delete;

 private:
  CoarseSurfaces& coarse_;
  const std::string key_;
};

// A node's surface and those below it that are not kept.
class CoarseMaker final {
 public:
  CoarseMaker(const Snapshot& snapshot, const StoredSurface& surface, ReconstructionId id,
              CoarseSurfaces* coarse)
      : snapshot_(snapshot), surface_(surface), id_(id), coarse_(*coarse) {}

  // Names hash what is below a node, but two reconstructions may have tiles alike.
  static std::string Key(ReconstructionId id, const std::string& name) {
    return std::to_string(id.value) + "/" + name;
  }

  Result<SharedSurface> Make(const TileNode& node) {
    if (node.level == 0) return LeafOrDamage(node.place);
    const std::string key = Key(id_, TileName(node));
    const MakingTurn turn(&coarse_, key);
    return coarse_.meshes.GetOrMake(
        key, [&] { return Join(node); },
        [](const SharedSurface& surface) { return BytesOf(surface->mesh); });
  }

 private:
  // A damaged leaf costs nothing but itself: otherwise nobody would see the city from afar.
  Result<SharedSurface> LeafOrDamage(GridPlace place) {
    const auto surface = std::make_shared<CoarseSurface>();
    Result<TriangleMesh> leaf = LoadLeaf(snapshot_, surface_.tiles.at(place));
    if (leaf.ok()) {
      surface->mesh = *std::move(leaf);
      return SharedSurface(surface);
    }
    const StatusCode code = leaf.status().code();
    if (code != StatusCode::kCorruption && code != StatusCode::kNotFound) return leaf.status();
    surface->left_out.push_back("the surface of " + NameOf(id_) + " at tile " +
                                std::to_string(place.x) + ", " + std::to_string(place.y) + ", " +
                                std::to_string(place.z) +
                                " is left out: " + leaf.status().message());
    return SharedSurface(surface);
  }

  Result<SharedSurface> Join(const TileNode& node) {
    const auto joined = std::make_shared<CoarseSurface>();
    std::vector<SharedSurface> kept;
    std::vector<const TriangleMesh*> children;
    for (const uint32_t child : node.children) {
      VEDUTA_ASSIGN_OR_RETURN(kept.emplace_back(), Make(surface_.tree.nodes()[child]));
      children.push_back(&kept.back()->mesh);
      for (const std::string& damage : kept.back()->left_out) {
        if (joined->left_out.size() < kLeftOutMax) joined->left_out.push_back(damage);
      }
    }
    Result<TriangleMesh> mesh = JoinCells(node, surface_.tree.voxel_size(), children);
    if (!mesh.ok()) return AsDamage(mesh.status());
    joined->mesh = *std::move(mesh);
    return SharedSurface(joined);
  }

  const Snapshot& snapshot_;
  const StoredSurface& surface_;
  const ReconstructionId id_;
  CoarseSurfaces& coarse_;
};

// The record of a tile that readers see, wherever it is stored while the surface moves.
Result<std::optional<TileRecord>> FindCurrentTile(const Snapshot& snapshot, ReconstructionId id,
                                                  GridPlace place) {
  VEDUTA_ASSIGN_OR_RETURN(auto tile, snapshot.dense().FindTile(id, place));
  if (tile) return tile;
  VEDUTA_ASSIGN_OR_RETURN(const bool moves, IsMoving(snapshot, id));
  if (!moves) return tile;
  return snapshot.dense().FindTile(StagedSurfaceOf(id), place);
}

Result<TriangleMesh> FindLeaf(const Snapshot& snapshot, ReconstructionId id,
                              const std::string& name, const ParsedTileName& parsed) {
  VEDUTA_ASSIGN_OR_RETURN(const double voxel_size, VoxelSize(snapshot, id));
  VEDUTA_ASSIGN_OR_RETURN(const auto tile, FindCurrentTile(snapshot, id, parsed.place));
  if (!tile || tile->triangle_count == 0 ||
      LeafVersion(LeafOf(*tile), voxel_size) != parsed.version)
    return IsSuperseded(name);
  return LoadLeaf(snapshot, *tile);
}

Result<SharedSurface> FindCoarse(const Snapshot& snapshot, ReconstructionId id,
                                 const std::string& name, const ParsedTileName& parsed,
                                 CoarseSurfaces* coarse) {
  if (SharedSurface kept = coarse->meshes.Find(CoarseMaker::Key(id, name))) return kept;
  VEDUTA_ASSIGN_OR_RETURN(const StoredSurface surface, LoadStoredSurface(snapshot, id));
  const auto& nodes = surface.tree.nodes();
  const auto node = std::ranges::find_if(nodes, [&](const TileNode& one) {
    return one.version == parsed.version && one.level == parsed.level && one.place == parsed.place;
  });
  if (node == nodes.end()) return IsSuperseded(name);
  return CoarseMaker(snapshot, surface, id, coarse).Make(*node);
}

// In double where a viewer adds it, so it need not be the middle of what is drawn.
Eigen::Vector3d CenterOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& x : mesh.positions) box.extend(x);
  return mesh.positions.empty() ? Eigen::Vector3d::Zero() : box.center().cast<double>().eval();
}

Result<std::vector<uint8_t>> GlbOf(const TriangleMesh& mesh) {
  Result<std::vector<uint8_t>> glb = MakeGlbTile(mesh, CenterOf(mesh));
  return glb.ok() ? std::move(glb) : AsDamage(glb.status());
}

}  // namespace

Result<TilesetAnswer> MakeTileset(const Snapshot& snapshot, ReconstructionId id) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, GetLiving(snapshot, id));
  VEDUTA_ASSIGN_OR_RETURN(const StoredSurface surface, LoadStoredSurface(snapshot, id));
  std::optional<Eigen::Matrix4d> earth_from_world;
  if (const auto& place = record.georeference.place) {
    const Sim3& enu_from_world = place->enu_from_world;
    Eigen::Matrix4d similarity = Eigen::Matrix4d::Identity();
    similarity.topLeftCorner<3, 3>() =
        enu_from_world.scale * enu_from_world.rotation.toRotationMatrix();
    similarity.topRightCorner<3, 1>() = enu_from_world.translation;
    earth_from_world = LocalFrame(place->origin).EcefFromEnu() * similarity;
  }
  TilesetAnswer answer;
  answer.json = TilesetJson(surface.tree, earth_from_world);
  ContentFeed feed;
  feed << answer.json;
  answer.tag = feed.Finish().Hex().substr(0, 32);
  return answer;
}

Result<SurfaceTileAnswer> MakeSurfaceTile(const Snapshot& snapshot, ReconstructionId id,
                                          const std::string& name, CoarseSurfaces* coarse) {
  VEDUTA_RETURN_IF_ERROR(GetLiving(snapshot, id).status());
  const std::optional<ParsedTileName> parsed = ParseTileName(name);
  if (!parsed) return IsSuperseded(name);
  SurfaceTileAnswer answer;
  if (parsed->level == 0) {
    VEDUTA_ASSIGN_OR_RETURN(const TriangleMesh leaf, FindLeaf(snapshot, id, name, *parsed));
    VEDUTA_ASSIGN_OR_RETURN(answer.glb, GlbOf(leaf));
    return answer;
  }
  VEDUTA_ASSIGN_OR_RETURN(const SharedSurface surface,
                          FindCoarse(snapshot, id, name, *parsed, coarse));
  answer.left_out = surface->left_out;
  VEDUTA_ASSIGN_OR_RETURN(answer.glb, GlbOf(surface->mesh));
  return answer;
}

}  // namespace veduta
