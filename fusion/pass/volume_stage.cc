// SPDX-License-Identifier: Apache-2.0
// Histograms: every tile holds exactly the checked depth maps that there are now. What is new is
// added to a tile, what is gone is withdrawn; a block that nobody names any more goes.
#include <algorithm>
#include <bit>
#include <map>
#include <string>

#include "fusion/pass/range_images.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/volume/histogram.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Maps that a tile holds: more than so many of full weight, and a voxel's counters would overflow
// (fusion/volume/histogram.h).
constexpr size_t kTileMapsMax = 1000;

// How much of all maps' surface lies in a block.
struct Naming {
  uint64_t pixels = 0;
  uint32_t maps = 0;
};

struct Vote {
  std::shared_ptr<const RangeImage> image;
  int sign = 1;
};

// What becomes of one block.
struct BlockWork {
  GridPlace index;
  uint8_t number = 0;
  std::unique_ptr<HistogramBlock> histogram;
  bool is_new = false, changed = false;
  Status status;
};

class VolumeStage final {
 public:
  VolumeStage(const VolumeStageOptions& options, const BlockAllocation& allocation, DensePass* pass)
      : options_(options),
        allocation_(allocation),
        pass_(*pass),
        snapshot_(pass->GetSnapshot()),
        images_(snapshot_, pass->map_bytes_max()) {}

  Result<StageCount> Run() {
    VEDUTA_RETURN_IF_ERROR(FindTiles());
    size_t done = 0;
    for (const auto& [place, wanted] : tiles_) {
      VEDUTA_RETURN_IF_ERROR(pass_.Tell("volume", done++, tiles_.size()));
      VEDUTA_RETURN_IF_ERROR(Update(place, wanted));
    }
    VEDUTA_RETURN_IF_ERROR(pass_.Tell("volume", done, tiles_.size()));
    return count_;
  }

 private:
  // Allocated blocks of every tile, by the pixels of all maps; and the tiles stored that have none
  // any more.
  Status FindTiles() {
    std::map<ImageId, uint64_t> current;
    VEDUTA_RETURN_IF_ERROR(snapshot_->dense().ScanDepths([&](const DepthRecord& depth) {
      if (depth.reconstruction == pass_.reconstruction())
        current[depth.image] = depth.checked_version;
      return true;
    }));
    std::map<GridPlace, Naming> named;
    VEDUTA_RETURN_IF_ERROR(snapshot_->dense().ScanCheckedDepths([&](CheckedDepthRecord depth) {
      const auto found = current.find(depth.image);
      if (found == current.end() || found->second != depth.version) return true;
      for (const SeenBlock& seen : depth.blocks) {
        Naming& naming = named[seen.place];
        naming.pixels += seen.pixel_count;
        ++naming.maps;
      }
      depth.blocks = {};  // a city's would not fit
      depths_.push_back(std::move(depth));
      return true;
    }));
    VEDUTA_RETURN_IF_ERROR(
        snapshot_->dense().ScanTiles(pass_.surface(), [&](const TileRecord& tile) {
          tiles_[tile.place] = 0;
          return true;
        }));
    for (const auto& [block, naming] : named) {
      if (naming.pixels < allocation_.block_pixel_count_min ||
          naming.maps < allocation_.block_map_count_min)
        continue;
      tiles_[TileOf(block)] |= 1ull << NumberInTile(block);
    }
    return Status::Ok();
  }

  uint64_t VersionOfVolume(const TileRecord& tile) const {
    VersionFeed feed(options_);
    feed << tile.blocks;
    for (const DepthVersion& depth : tile.depths) feed << depth.image << depth.version;
    return feed.Version();
  }

  Status Update(GridPlace place, uint64_t wanted) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<TileRecord> found,
                            snapshot_->dense().FindTile(pass_.surface(), place));
    if (wanted == 0) return Drop(place);
    TileRecord last;
    if (found) last = *found;
    TileRecord tile = last;
    tile.blocks = wanted;
    tile.depths.clear();
    for (const CheckedDepthRecord& depth : depths_) {
      if (MaySeeTile(GeometryOf(depth), depth.depth_far, place, options_.grid))
        tile.depths.push_back({depth.image, 0, depth.version});
    }
    KeepSome(kTileMapsMax, &tile.depths);
    tile.volume_version = VersionOfVolume(tile);
    if (last.volume_version == tile.volume_version) {
      ++count_.kept;
      return Status::Ok();
    }
    ++count_.computed;
    VEDUTA_ASSIGN_OR_RETURN(const bool has_parts, HasParts(last));
    if (!has_parts) {
      last = {};
      tile.histogram_version = tile.first_round_version = tile.solution_version = 0;
      tile.mesh_version = tile.color_version = 0;
    }
    for (TileRecord* const record : {&last, &tile}) {
      record->reconstruction = pass_.surface();
      record->place = place;
    }
    const Status done = Integrate(found, last, tile, /*from_nothing=*/false);
    if (done.code() != StatusCode::kNotFound) return done;
    // It holds a map that is not there, as earlier programs left it where a photo was taken out
    // under a pass.
    return Integrate(found, last, tile, /*from_nothing=*/true);
  }

  // Whether what the record says is there. Earlier programs left records without their parts where
  // a photo was taken out under a pass.
  Result<bool> HasParts(const TileRecord& tile) const {
    const DenseReader& dense = snapshot_->dense();
    const auto block = static_cast<uint8_t>(std::countr_zero(tile.blocks));
    if (tile.blocks != 0 && tile.histogram_version != 0) {
      const Status found = dense.GetVolumeBlock(tile.reconstruction, tile.place, block).status();
      if (found.code() == StatusCode::kNotFound) return false;
      VEDUTA_RETURN_IF_ERROR(found);
    }
    if (tile.solution_version == 0) return true;
    const Status found =
        dense.GetSurface(SurfacePart::kSolution, tile.reconstruction, tile.place).status();
    if (found.code() == StatusCode::kNotFound) return false;
    VEDUTA_RETURN_IF_ERROR(found);
    return true;
  }

  Status Drop(GridPlace place) {
    ++count_.removed;
    return pass_.Commit([&](const Snapshot&, Transaction* transaction) {
      transaction->dense().DeleteTile(pass_.surface(), place);
      return Status::Ok();
    });
  }

  // The changes from `last` to `tile`; all maps of `tile` where that is asked for or is less work,
  // or where what is stored was made with other options or by another algorithm.
  Result<std::vector<Vote>> VotesBetween(const TileRecord& last, const TileRecord& tile,
                                         bool* from_nothing) {
    if (*from_nothing) return VotesOf(tile.depths, +1);
    std::vector<DepthVersion> added, withdrawn;
    std::ranges::set_difference(tile.depths, last.depths, std::back_inserter(added));
    std::ranges::set_difference(last.depths, tile.depths, std::back_inserter(withdrawn));
    *from_nothing = last.volume_version != VersionOfVolume(last) ||
                    added.size() + withdrawn.size() >= tile.depths.size();
    if (*from_nothing) return VotesOf(tile.depths, +1);
    VEDUTA_ASSIGN_OR_RETURN(std::vector<Vote> votes, VotesOf(withdrawn, -1));
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Vote> more, VotesOf(added, +1));
    votes.insert(votes.end(), more.begin(), more.end());
    return votes;
  }

  Result<std::vector<Vote>> VotesOf(std::span<const DepthVersion> depths, int sign) {
    std::vector<Vote> votes;
    for (const DepthVersion& depth : depths) {
      VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const RangeImage> image,
                              images_.Get(depth.image, depth.version));
      votes.push_back({std::move(image), sign});
    }
    return votes;
  }

  Result<std::vector<BlockWork>> Prepare(const TileRecord& last, const TileRecord& tile,
                                         bool from_nothing) const {
    std::vector<BlockWork> works;
    for (const GridPlace& index : BlocksOfTile(tile.place)) {
      BlockWork work{index, NumberInTile(index), std::make_unique<HistogramBlock>(), false, false,
                     {}};
      const uint64_t bit = 1ull << work.number;
      if (!(tile.blocks & bit)) continue;
      work.is_new = from_nothing || !(last.blocks & bit);
      if (!work.is_new) {
        VEDUTA_ASSIGN_OR_RETURN(
            const StoredBytes bytes,
            snapshot_->dense().GetVolumeBlock(tile.reconstruction, tile.place, work.number));
        VEDUTA_ASSIGN_OR_RETURN(work.histogram, ParseHistogramBlock(bytes.bytes()));
      }
      works.push_back(std::move(work));
    }
    return works;
  }

  Status CastVotes(std::span<const Vote> votes, BlockWork* work) const {
    for (const Vote& vote : votes) {
      VEDUTA_RETURN_IF_ERROR(pass_.CheckStop());
      if (!vote.image->MaySee(work->index, options_.grid)) continue;
      VEDUTA_ASSIGN_OR_RETURN(const Integration done,
                              veduta::Integrate(*vote.image, options_.grid, work->index, vote.sign,
                                                work->histogram.get()));
      work->changed |= done.changed;
    }
    return Status::Ok();
  }

  Status Integrate(const std::optional<TileRecord>& as_read, const TileRecord& last,
                   TileRecord tile, bool from_nothing) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Vote> votes, VotesBetween(last, tile, &from_nothing));
    VEDUTA_ASSIGN_OR_RETURN(std::vector<BlockWork> works, Prepare(last, tile, from_nothing));
    // Blocks new to the tile get every map, the others the changes only.
    std::vector<Vote> all = votes;
    const bool some_new =
        std::ranges::any_of(works, [](const BlockWork& work) { return work.is_new; });
    if (!from_nothing && some_new) {
      VEDUTA_ASSIGN_OR_RETURN(all, VotesOf(tile.depths, +1));
    }
    pass_.pool().ParallelFor(works.size(), [&](size_t i) {
      works[i].status = CastVotes(works[i].is_new ? all : votes, &works[i]);
    });
    const GridPlace place = tile.place;
    return pass_.CommitTile(as_read, place, [&](const Snapshot& now, Transaction* transaction) {
      VEDUTA_RETURN_IF_ERROR(ExpectThere(now, tile.depths));
      return Write(last, works, std::move(tile), &transaction->dense());
    });
  }

  // That no map has been deleted since the stage began.
  Status ExpectThere(const Snapshot& now, std::span<const DepthVersion> depths) {
    for (const DepthVersion& depth : depths) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<DepthRecord> found,
                              now.dense().FindDepth(depth.image));
      if (!found || found->checked_version != depth.version) return pass_.NoteOvertaken();
    }
    return Status::Ok();
  }

  // The blocks that have changed, and the tile's record.
  Status Write(const TileRecord& last, std::span<const BlockWork> works, TileRecord tile,
               DenseWriter* writer) {
    DenseWriter& dense = *writer;
    if (last.blocks != tile.blocks) tile.histogram_version = tile.volume_version;
    for (const BlockWork& work : works) {
      VEDUTA_RETURN_IF_ERROR(work.status);
      if (!work.changed && !work.is_new) continue;
      tile.histogram_version = tile.volume_version;
      dense.PutVolumeBlock(tile.reconstruction, tile.place, work.number,
                           Serialize(*work.histogram));
      ++count_.units;
    }
    for (uint8_t number = 0; number < kTileBlockCount; ++number) {
      const uint64_t bit = 1ull << number;
      if ((last.blocks & bit) && !(tile.blocks & bit))
        dense.DeleteVolumeBlock(tile.reconstruction, tile.place, number);
    }
    dense.PutTile(tile);
    return Status::Ok();
  }

  const VolumeStageOptions& options_;
  const BlockAllocation& allocation_;
  DensePass& pass_;
  const std::shared_ptr<const Snapshot> snapshot_;  // each tile is looked at once
  RangeImages images_;
  std::vector<CheckedDepthRecord> depths_;  // current ones, without their blocks; ascending
  std::map<GridPlace, uint64_t> tiles_;     // allocated blocks
  StageCount count_;
};

}  // namespace

Result<StageCount> UpdateVolume(const VolumeStageOptions& options,
                                const BlockAllocation& allocation, DensePass* pass) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(StageCount count, VolumeStage(options, allocation, pass).Run());
  count.ms = watch.LapMs();
  return count;
}

}  // namespace veduta
