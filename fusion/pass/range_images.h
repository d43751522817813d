// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checked depth maps from the database, ready for fusion.

#include <memory>
#include <utility>

#include "fusion/volume/range_image.h"
#include "storage/base/lru_cache.h"
#include "storage/database.h"

namespace veduta {

ViewGeometry GeometryOf(const CheckedDepthRecord& depth);

// Whether any voxel of a tile may lie in the view's frustum and not beyond `far` and the
// truncation. Conservative, by the tile's bounding sphere.
bool MaySeeTile(const ViewGeometry& view, double far, GridPlace tile, const VolumeGrid& grid);

// Keeps the images that were asked for last. Thread-safe.
class RangeImages final {
 public:
  // Images of up to bytes_max bytes are kept, 9 for each of their pixels, and the last one in any
  // case.
  RangeImages(std::shared_ptr<const Snapshot> snapshot, uint64_t bytes_max)
      : snapshot_(std::move(snapshot)), images_(bytes_max) {}

  Result<std::shared_ptr<const RangeImage>> Get(ImageId image, uint64_t version);

 private:
  const std::shared_ptr<const Snapshot> snapshot_;
  // By version, which is a hash of all that the map was made from.
  LruCache<uint64_t, std::shared_ptr<const RangeImage>> images_;
};

}  // namespace veduta
