// SPDX-License-Identifier: Apache-2.0
// What the dense pass keeps. All of it is computed from photos and poses: what cannot be read is
// left out, and the next pass makes it again.
#include "engine/repair/healing.h"

namespace veduta {
namespace {

std::string NameOfSurface(ReconstructionId id) {
  const ReconstructionId owner = OwnerOfSurface(id);
  return (owner == id ? "the surface of reconstruction "
                      : "the unfinished surface of reconstruction ") +
         std::to_string(owner.value);
}

class DenseHealer {
 public:
  explicit DenseHealer(HealingWork* healing) : healing_(healing), from_(healing->from().dense()) {}

  Status Run() {
    if (!healing_->options.keeps_dense) return Status::Ok();
    for (const auto& [id, image] : healing_->images) VEDUTA_RETURN_IF_ERROR(TakeDepth(id));
    for (const auto& [id, record] : healing_->reconstructions) {
      if (!record.is_living()) continue;
      // A surface on another grid is made, or moves, under an id of its own.
      for (const ReconstructionId surface : {id, StagedSurfaceOf(id)})
        VEDUTA_RETURN_IF_ERROR(TakeSurface(surface));
    }
    Note(lost_depths_, "depth maps");
    Note(lost_tiles_, "tiles of surfaces");
    return Status::Ok();
  }

 private:
  void Note(uint32_t lost, const std::string& what) {
    if (lost == 0) return;
    healing_->notes.Add(std::to_string(lost) + " " + what + " cannot be read",
                        "'veduta densify' makes them again");
  }

  // Whether it can be read; a failure that is no damage is kept in status_.
  template <typename T>
  bool IsRead(const Result<T>& read) {
    if (!read.ok() && !IsDamage(read.status()) && status_.ok()) status_ = read.status();
    return read.ok();
  }

  Status TakeDepth(ImageId image) {
    const Result<std::optional<DepthRecord>> depth = from_.FindDepth(image);
    if (IsRead(depth) && !*depth) return Status::Ok();
    const bool wanted = depth.ok() && healing_->FindPhoto(image) != nullptr &&
                        healing_->IsLiving((*depth)->reconstruction);
    if (depth.ok() && !wanted) return Status::Ok();
    bool kept = depth.ok();
    if (kept) {
      const Result<DepthPixels> pixels = from_.GetDepthPixels(image);
      kept = IsRead(pixels);
      if (kept && (*depth)->checked_version != 0) {
        VEDUTA_ASSIGN_OR_RETURN(kept, TakeChecked({image, 0, (*depth)->checked_version}));
      }
      if (kept) {
        VEDUTA_RETURN_IF_ERROR(healing_->writer.Put([&](Transaction& transaction) {
          transaction.dense().PutDepth(**depth);
          transaction.dense().PutDepthPixels(image, *pixels);
        }));
      }
    }
    if (!kept) ++lost_depths_;
    return status_;
  }

  // Whether the checked depth map is in the new database.
  Result<bool> TakeChecked(const DepthVersion& version) {
    if (const auto known = checked_.find(version); known != checked_.end()) return known->second;
    const Result<CheckedDepthRecord> depth = from_.GetCheckedDepth(version.image, version.version);
    const Result<DepthPixels> pixels = from_.GetCheckedDepthPixels(version.image, version.version);
    const bool read = IsRead(depth) && IsRead(pixels);
    VEDUTA_RETURN_IF_ERROR(status_);
    checked_[version] = read;
    if (!read) return false;
    VEDUTA_RETURN_IF_ERROR(healing_->writer.Put(
        [&](Transaction& transaction) { transaction.dense().PutCheckedDepth(*depth, *pixels); }));
    return true;
  }

  Status TakeSurface(ReconstructionId id) {
    const Result<std::optional<DenseSettings>> settings = from_.FindSettings(id);
    if (!IsRead(settings)) {
      healing_->notes.Add("the settings of " + NameOfSurface(id) + " cannot be read",
                          "the surface is left out; 'veduta densify' makes it again");
      return status_;
    }
    if (!*settings) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(healing_->writer.Put(
        [&](Transaction& transaction) { transaction.dense().PutSettings(**settings); }));
    std::vector<TileRecord> tiles;
    const Status scanned = from_.ScanTiles(id, [&](const TileRecord& tile) {
      tiles.push_back(tile);
      return true;
    });
    if (!scanned.ok()) {
      if (!IsDamage(scanned)) return scanned;
      healing_->notes.Add(
          "the list of the tiles of " + NameOfSurface(id) + " cannot be read: " + scanned.message(),
          "'veduta densify' makes those again that are not found");
    }
    for (const TileRecord& tile : tiles) VEDUTA_RETURN_IF_ERROR(TakeTile(tile));
    return Status::Ok();
  }

  Status TakeTile(const TileRecord& tile) {
    bool kept = true;
    for (const DepthVersion& depth : tile.depths) {
      if (!kept) break;
      VEDUTA_ASSIGN_OR_RETURN(kept, TakeChecked(depth));
    }
    std::map<uint8_t, StoredBytes> blocks;
    for (uint8_t block = 0; kept && block < kTileBlockCount; ++block) {
      if ((tile.blocks >> block & 1) == 0) continue;
      Result<StoredBytes> bytes = from_.GetVolumeBlock(tile.reconstruction, tile.place, block);
      kept = IsRead(bytes);
      if (kept) blocks[block] = std::move(*bytes);
    }
    const std::map<SurfacePart, uint64_t> versions = {
        {SurfacePart::kSolution, tile.solution_version},
        {SurfacePart::kMesh, tile.mesh_version},
        {SurfacePart::kColors, tile.color_version},
        {SurfacePart::kFirstRound, tile.first_round_version}};
    std::map<SurfacePart, StoredBytes> parts;
    for (const auto& [part, version] : versions) {
      if (!kept) break;
      Result<StoredBytes> bytes = from_.GetSurface(part, tile.reconstruction, tile.place);
      if (!bytes.ok() && bytes.status().code() == StatusCode::kNotFound && version == 0) continue;
      kept = IsRead(bytes);
      if (kept) parts[part] = std::move(*bytes);
    }
    VEDUTA_RETURN_IF_ERROR(status_);
    if (!kept) ++lost_tiles_;
    return kept ? WriteTile(tile, blocks, parts) : Status::Ok();
  }

  Status WriteTile(const TileRecord& tile, const std::map<uint8_t, StoredBytes>& blocks,
                   const std::map<SurfacePart, StoredBytes>& parts) {
    return healing_->writer.Put([&](Transaction& transaction) {
      DenseWriter& dense = transaction.dense();
      dense.PutTile(tile);
      for (const auto& [block, bytes] : blocks)
        dense.PutVolumeBlock(tile.reconstruction, tile.place, block, bytes.bytes());
      for (const auto& [part, bytes] : parts)
        dense.PutSurface(part, tile.reconstruction, tile.place, bytes.bytes());
    });
  }

  HealingWork* const healing_;
  const DenseReader& from_;
  std::map<DepthVersion, bool> checked_;
  uint32_t lost_depths_ = 0, lost_tiles_ = 0;
  Status status_;
};

}  // namespace

Status HealDense(HealingWork* healing) {
  return DenseHealer(healing).Run();
}

}  // namespace veduta
