// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checked depth maps from the database, ready for fusion.

#include <list>
#include <memory>

#include "fusion/volume/range_image.h"
#include "storage/database.h"

namespace veduta {

ViewGeometry GeometryOf(const CheckedDepthRecord& depth);

// Whether any voxel of a tile may lie in the view's frustum and not beyond `far` and the
// truncation. Conservative, by the tile's bounding sphere.
bool MaySeeTile(const ViewGeometry& view, double far, GridPlace tile, const VolumeGrid& grid);

// Not thread-safe; the images are. Keeps those last asked for.
class RangeImages final {
 public:
  // 9 bytes a pixel for each of at most image_count_max >= 1.
  RangeImages(std::shared_ptr<const Snapshot> snapshot, size_t image_count_max)
      : snapshot_(std::move(snapshot)), image_count_max_(image_count_max) {}

  Result<std::shared_ptr<const RangeImage>> Get(ImageId image, uint64_t version);

 private:
  struct Entry {
    ImageId image;
    uint64_t version;
    std::shared_ptr<const RangeImage> value;
  };

  const std::shared_ptr<const Snapshot> snapshot_;
  const size_t image_count_max_;
  std::list<Entry> entries_;  // newest first
};

}  // namespace veduta
