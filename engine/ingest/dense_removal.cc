// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/dense_removal.h"

#include <algorithm>
#include <set>
#include <vector>

namespace veduta {
namespace {

using Images = std::set<ImageId>;

bool IsMadeWith(const DepthRecord& depth, const Images& images) {
  return images.contains(depth.image) ||
         std::ranges::any_of(depth.sensors,
                             [&](const auto& sensor) { return images.contains(sensor.image); });
}

// Depth maps, raw and checked, that are of the images or were made with them.
struct MadeWith {
  std::set<ImageId> depths;
  std::set<DepthVersion> checked;
  std::vector<DepthRecord> left_unchecked;  // depth maps that stay, without a checked one
};

Result<MadeWith> FindMadeWith(const Snapshot& snapshot, const Images& images) {
  MadeWith made;
  std::vector<DepthRecord> others;
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanDepths([&](const DepthRecord& depth) {
    if (IsMadeWith(depth, images)) {
      made.depths.insert(depth.image);
    } else {
      others.push_back(depth);
    }
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    const bool is_against = std::ranges::any_of(
        depth.neighbors, [&](const DepthVersion& other) { return images.contains(other.image); });
    if (is_against || made.depths.contains(depth.image) || images.contains(depth.image))
      made.checked.insert({depth.image, 0, depth.version});
    return true;
  }));
  for (DepthRecord& depth : others) {
    if (!made.checked.contains({depth.image, 0, depth.checked_version})) continue;
    depth.checked_version = 0;
    made.left_unchecked.push_back(std::move(depth));
  }
  return made;
}

// The tiles that hold one of the maps, in the surface of every reconstruction, staged ones too.
Result<bool> DeleteTiles(const Snapshot& snapshot, const MadeWith& made, Transaction* transaction) {
  bool some = false;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<DenseSettings> settings,
                          snapshot.dense().ListSettings());
  for (const DenseSettings& one : settings) {
    VEDUTA_RETURN_IF_ERROR(
        snapshot.dense().ScanTiles(one.reconstruction, [&](const TileRecord& tile) {
          const bool holds = std::ranges::any_of(
              tile.depths, [&](const DepthVersion& depth) { return made.checked.contains(depth); });
          if (holds) transaction->dense().DeleteTile(one.reconstruction, tile.place);
          some = some || holds;
          return true;
        }));
  }
  return some;
}

}  // namespace

Result<bool> RemoveFromDense(const Snapshot& snapshot, std::span<const ImageId> images,
                             Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const MadeWith made,
                          FindMadeWith(snapshot, Images(images.begin(), images.end())));
  VEDUTA_ASSIGN_OR_RETURN(const bool has_tiles, DeleteTiles(snapshot, made, transaction));
  for (const DepthVersion& depth : made.checked)
    transaction->dense().DeleteCheckedDepth(depth.image, depth.version);
  for (const ImageId id : made.depths) transaction->dense().DeleteDepth(id);
  for (const DepthRecord& depth : made.left_unchecked) transaction->dense().PutDepth(depth);
  return has_tiles || !made.depths.empty() || !made.checked.empty();
}

}  // namespace veduta
