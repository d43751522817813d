// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/dense_invariants.h"

#include <algorithm>
#include <set>

#include "fusion/depth/depth_codes.h"
#include "fusion/pass/tile_parts.h"

namespace veduta {
namespace {

std::string Name(const TileRecord& tile) {
  return "tile " + std::to_string(tile.place.x) + "," + std::to_string(tile.place.y) + "," +
         std::to_string(tile.place.z) + " of reconstruction " +
         std::to_string(tile.reconstruction.value);
}

class Checker final {
 public:
  Checker(const Snapshot& snapshot, size_t count_max)
      : snapshot_(snapshot), dense_(snapshot.dense()), count_max_(count_max) {}

  Status Run() {
    VEDUTA_RETURN_IF_ERROR(CheckDepths());
    VEDUTA_RETURN_IF_ERROR(CheckCheckedDepths());
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<DenseSettings> settings, dense_.ListSettings());
    for (const DenseSettings& one : settings) {
      VEDUTA_ASSIGN_OR_RETURN(const TileRecords tiles,
                              LoadTileRecords(snapshot_, one.reconstruction));
      for (const auto& [place, tile] : tiles) CheckTile(tile);
    }
    return Status::Ok();
  }
  std::vector<std::string> Take() { return std::move(violations_); }

 private:
  void Expect(bool holds, const std::string& violation) {
    if (!holds && violations_.size() < count_max_) violations_.push_back(violation);
  }
  void Expect(const Status& status, const std::string& what) {
    Expect(status.ok(), what + ": " + status.message());
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

  Status CheckDepths() {
    return dense_.ScanDepths([&](const DepthRecord& depth) {
      const std::string name = "depth map of image " + std::to_string(depth.image.value);
      Expect(snapshot_.GetImage(depth.image).status(), name);
      Expect(snapshot_.GetReconstruction(depth.reconstruction).status(), name);
      CheckPixels(depth, dense_.GetDepthPixels(depth.image), name);
      if (depth.checked_version != 0) {
        Expect(dense_.GetCheckedDepth(depth.image, depth.checked_version).status(), name);
      }
      return violations_.size() < count_max_;
    });
  }

  Status CheckCheckedDepths() {
    return dense_.ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
      const std::string name = "checked depth map of image " + std::to_string(depth.image.value);
      CheckPixels(depth, dense_.GetCheckedDepthPixels(depth.image, depth.version), name);
      checked_.insert({depth.image, 0, depth.version});
      return violations_.size() < count_max_;
    });
  }

  void CheckTile(const TileRecord& tile) {
    const std::string name = Name(tile);
    Expect(tile.blocks != 0, name + " has no blocks");
    for (const DepthVersion& depth : tile.depths) {
      Expect(checked_.contains(depth), name + " holds a depth map of image " +
                                           std::to_string(depth.image.value) +
                                           " that is not there");
    }
    const TileRecords alone = {{tile.place, tile}};
    Expect(LoadHistograms(snapshot_, alone, tile.place).status(), name);
    Expect(LoadSolutions(snapshot_, alone, tile.place).status(), name);
    if (tile.mesh_version == 0) return;
    const Result<TileSurface> surface = LoadSurface(snapshot_, tile);
    Expect(surface.status(), name);
    if (!surface.ok()) return;
    Expect(surface->piece.triangles.size() == tile.triangle_count &&
               surface->piece.keys.size() == tile.vertex_count,
           name + " has " + std::to_string(surface->piece.triangles.size()) +
               " triangles; its record says " + std::to_string(tile.triangle_count));
  }

  const Snapshot& snapshot_;
  const DenseReader& dense_;
  const size_t count_max_;
  std::set<DepthVersion> checked_;
  std::vector<std::string> violations_;
};

}  // namespace

Result<std::vector<std::string>> FindDenseViolations(const Snapshot& snapshot, size_t count_max) {
  Checker checker(snapshot, count_max);
  VEDUTA_RETURN_IF_ERROR(checker.Run());
  return checker.Take();
}

}  // namespace veduta
