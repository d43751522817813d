// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/dense_invariants.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/query/replaced_images.h"
#include "engine/query/stored_records.h"
#include "fusion/depth/depth_codes.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"
#include "storage/records/dense_entry.h"
#include "storage/records/dense_settings.h"
#include "storage/records/depth_record.h"
#include "storage/records/tile_record.h"

namespace veduta {
namespace {

// Of a vertex from its edge, in voxels: positions are floats, and a city spans a million voxels at
// most. Chosen by hand; not measured.
constexpr double kVertexSlack = 0.1;
constexpr double kPinholeSlack = 1e-9;  // relative: the same operations, rounded; chosen by hand

std::string Name(const TileRecord& tile) {
  return "tile " + std::to_string(tile.place.x) + "," + std::to_string(tile.place.y) + "," +
         std::to_string(tile.place.z) + " of reconstruction " +
         std::to_string(tile.reconstruction.value);
}

bool IsNear(double a, double b) {
  return std::abs(a - b) <= kPinholeSlack * std::max(std::abs(a), std::abs(b));
}

class Checker final {
 public:
  Checker(const Snapshot& snapshot, Violations* violations)
      : snapshot_(snapshot), dense_(snapshot.dense()), violations_(*violations) {}

  Status Run() {
    // A damaged entry of the journal is told elsewhere.
    if (Result<std::set<ImageId>> replaced = ReplacedImages(snapshot_); replaced.ok())
      replaced_ = std::move(*replaced);
    VEDUTA_RETURN_IF_ERROR(WalkStored(
        snapshot_, Family::kDense, &violations_, [&](std::string_view key, std::string_view value) {
          const Status read = ReadRecord(key, value);
          if (!read.ok()) violations_.Add(PlaceOf(Family::kDense, key) + ": " + read.message());
        }));
    for (const auto& [id, depth] : depths_) CheckDepth(depth);
    for (const auto& [version, depth] : checked_) CheckChecked(depth);
    for (const auto& [key, tile] : tiles_) CheckTile(tile);
    VEDUTA_RETURN_IF_ERROR(ExpectNamed(Family::kDepth));
    VEDUTA_RETURN_IF_ERROR(ExpectNamed(Family::kVolume));
    return ExpectNamed(Family::kSurface);
  }

 private:
  void Expect(bool holds, const std::string& violation) { violations_.Expect(holds, violation); }
  void Expect(const Status& status, const std::string& what) {
    violations_.Expect(status.ok(), [&] { return what + ": " + status.message(); });
  }

  Status ReadRecord(std::string_view key, std::string_view value) {
    switch (static_cast<DenseEntry>(key.empty() ? 0 : key[0])) {
      case DenseEntry::kSettings: {
        DenseSettings settings;
        VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &settings.reconstruction));
        VEDUTA_RETURN_IF_ERROR(Decode(value, &settings));
        Expect(snapshot_.GetReconstruction(OwnerOfSurface(settings.reconstruction)).status(),
               "dense settings");
        settings_[settings.reconstruction] = settings;
        return Status::Ok();
      }
      case DenseEntry::kDepth: {
        DepthRecord depth;
        VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &depth.image));
        VEDUTA_RETURN_IF_ERROR(Decode(value, &depth));
        depths_[depth.image] = depth;
        return Status::Ok();
      }
      case DenseEntry::kCheckedDepth: {
        CheckedDepthRecord depth;
        VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &depth.image, &depth.version));
        VEDUTA_RETURN_IF_ERROR(Decode(value, &depth));
        checked_[{depth.image, 0, depth.version}] = depth;
        return Status::Ok();
      }
      case DenseEntry::kTile: {
        TileRecord tile;
        VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &tile.reconstruction, &tile.place));
        VEDUTA_RETURN_IF_ERROR(Decode(value, &tile));
        tiles_[std::string(key)] = tile;
        return Status::Ok();
      }
    }
    return Status::Corruption("a key of an unknown kind");
  }

  // Pixels that do not parse, do not fit, or are not as many as the record says.
  template <typename Record>
  void CheckPixels(const Record& depth, const Result<DepthPixels>& pixels,
                   const std::string& name) {
    Expect(pixels.status(), name);
    if (!pixels.ok()) return;
    Expect(
        DecodeDepth(*pixels, depth.width_px, depth.height_px, {depth.depth_near, depth.depth_far})
            .status(),
        name);
    const auto known =
        std::ranges::count_if(pixels->codes, [](uint16_t code) { return code != 0; });
    Expect(known == depth.known_count, name + " has " + std::to_string(known) +
                                           " depths; its record says " +
                                           std::to_string(depth.known_count));
  }

  // A depth map's pinhole follows from its photo's camera and its own size, unless it may be that
  // of an earlier photo of the image.
  template <typename Record>
  void CheckView(const Record& depth, const std::string& name) {
    Expect(snapshot_.GetReconstruction(depth.reconstruction).status(), name);
    const Result<ImageRecord> image = snapshot_.GetImage(depth.image);
    Expect(image.status(), name);
    if (!image.ok()) return;
    const Result<CameraRecord> camera = snapshot_.GetCamera(image->camera);
    Expect(camera.status(), name);
    if (!camera.ok() || replaced_.contains(depth.image)) return;
    const ViewGeometry view = ViewGeometryOf({*image, camera->model, depth.cam_from_world, {}},
                                             std::max(depth.width_px, depth.height_px));
    Expect(view.width_px == depth.width_px && view.height_px == depth.height_px &&
               IsNear(view.camera.fx, depth.fx) && IsNear(view.camera.fy, depth.fy) &&
               IsNear(view.camera.cx, depth.cx) && IsNear(view.camera.cy, depth.cy),
           name + ": its size and pinhole are not those of its photo's camera");
  }

  void CheckDepth(const DepthRecord& depth) {
    const std::string name = "depth map of image " + std::to_string(depth.image.value);
    CheckView(depth, name);
    for (const SensorPose& sensor : depth.sensors)
      Expect(snapshot_.GetImage(sensor.image).status(), name);
    named_[Family::kDepth].insert(DepthKey(depth.image));
    CheckPixels(depth, dense_.GetDepthPixels(depth.image), name);
    Expect(depth.checked_version == 0 || checked_.contains({depth.image, 0, depth.checked_version}),
           name + ": there is no such checked depth map");
  }

  void CheckChecked(const CheckedDepthRecord& depth) {
    const std::string name = "checked depth map of image " + std::to_string(depth.image.value);
    CheckView(depth, name);
    for (const DepthVersion& neighbor : depth.neighbors)
      Expect(snapshot_.GetImage(neighbor.image).status(), name);
    named_[Family::kDepth].insert(CheckedDepthKey(depth.image, depth.version));
    CheckPixels(depth, dense_.GetCheckedDepthPixels(depth.image, depth.version), name);
  }

  // The keys of the tile's parts; what is stored beside them is named by nothing.
  void NameParts(const TileRecord& tile) {
    for (uint8_t block = 0; block < kTileBlockCount; ++block) {
      if (tile.blocks >> block & 1)
        named_[Family::kVolume].insert(VolumeKey(tile.reconstruction, tile.place, block));
    }
    const std::pair<SurfacePart, uint64_t> parts[] = {
        {SurfacePart::kSolution, tile.solution_version},
        {SurfacePart::kMesh, tile.mesh_version},
        {SurfacePart::kColors, tile.color_version},
        {SurfacePart::kFirstRound, tile.first_round_version}};
    for (const auto& [part, version] : parts) {
      if (version != 0)
        named_[Family::kSurface].insert(SurfaceKey(part, tile.reconstruction, tile.place));
    }
  }

  void CheckTile(const TileRecord& tile) {
    const std::string name = Name(tile);
    const auto settings = settings_.find(tile.reconstruction);
    Expect(settings != settings_.end(), name + " is of a reconstruction without dense settings");
    Expect(tile.blocks != 0, name + " has no blocks");
    for (const DepthVersion& depth : tile.depths) {
      Expect(checked_.contains(depth), name + " holds a depth map of image " +
                                           std::to_string(depth.image.value) +
                                           " that is not there");
    }
    NameParts(tile);
    const TileRecords alone = {{tile.place, tile}};
    Expect(LoadHistograms(snapshot_, alone, tile.place).status(), name);
    for (const SurfacePart round : {SurfacePart::kFirstRound, SurfacePart::kSolution})
      Expect(LoadSolutions(snapshot_, alone, tile.place, round).status(), name);
    if (tile.mesh_version == 0) return;
    const Result<TileSurface> surface = LoadSurface(snapshot_, tile);
    Expect(surface.status(), name);
    if (!surface.ok()) return;
    Expect(surface->piece.triangles.size() == tile.triangle_count &&
               surface->piece.keys.size() == tile.vertex_count,
           name + " has " + std::to_string(surface->piece.triangles.size()) +
               " triangles; its record says " + std::to_string(tile.triangle_count));
    if (settings != settings_.end())
      Expect(LiesOnItsEdges(surface->piece, settings->second.voxel_size),
             name + " has a vertex beside the edge that it names");
  }

  static bool LiesOnItsEdges(const SurfacePiece& piece, double voxel_size) {
    for (size_t i = 0; i < piece.keys.size(); ++i) {
      const VertexKey& key = piece.keys[i];
      const Eigen::Vector3d from_voxel =
          piece.positions[i].cast<double>() / voxel_size -
          (Eigen::Vector3d(key.x, key.y, key.z) + Eigen::Vector3d::Constant(0.5));
      Eigen::Vector3d beside = from_voxel;
      beside[key.axis] = 0;
      const double along = from_voxel[key.axis];
      if (!(beside.norm() <= kVertexSlack && along >= -kVertexSlack && along <= 1 + kVertexSlack &&
            std::abs(piece.normals[i].norm() - 1) <= kVertexSlack))
        return false;
    }
    return true;
  }

  // What no record names, and what a record names that is not there.
  Status ExpectNamed(Family family) {
    std::set<std::string>& named = named_[family];
    VEDUTA_RETURN_IF_ERROR(WalkStored(
        snapshot_, family, &violations_, [&](std::string_view key, std::string_view /*value*/) {
          Expect(named.erase(std::string(key)) == 1,
                 PlaceOf(family, key) + ": no record of the dense pass names it");
        }));
    for (const std::string& key : named)
      Expect(false, PlaceOf(family, key) + ": is named by a record, and cannot be read");
    return Status::Ok();
  }

  const Snapshot& snapshot_;
  const DenseReader& dense_;
  Violations& violations_;
  std::set<ImageId> replaced_;  // they may have depth maps of an earlier photo
  std::map<ReconstructionId, DenseSettings> settings_;
  std::map<ImageId, DepthRecord> depths_;
  std::map<DepthVersion, CheckedDepthRecord> checked_;
  std::map<std::string, TileRecord> tiles_;  // by key
  std::map<Family, std::set<std::string>> named_;
};

}  // namespace

Result<std::vector<std::string>> FindDenseViolations(const Snapshot& snapshot, size_t count_max) {
  Violations violations(count_max);
  VEDUTA_RETURN_IF_ERROR(Checker(snapshot, &violations).Run());
  return violations.Take();
}

}  // namespace veduta
