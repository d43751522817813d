// SPDX-License-Identifier: Apache-2.0
#pragma once
// The offline pass: a reconstruction's photos to depth maps, a fused volume and a coloured surface,
// all of it in the database. It redoes what is stale and leaves the rest.

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/depth/depth_consistency.h"
#include "fusion/depth/depth_estimation.h"
#include "fusion/depth/sensor_views.h"
#include "fusion/surface/exposure.h"
#include "fusion/surface/vertex_color.h"
#include "fusion/volume/extraction.h"
#include "fusion/volume/solver.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

class Device;

struct DensifyOptions {
  // Kept with the reconstruction. Unset: as last time, and the first time as said.
  std::optional<uint32_t>
      depth_side_px;  // longer side of a depth map; 512, the paper's; 0: of the photo
  std::optional<uint32_t> sensor_count;  // [1, 16]; 2, the paper's
  std::optional<double> voxel_size;      // > 0, world units; `voxel_px` at the median depth

  double voxel_px = 1.5;        // (0, 100]; the first voxel size, in pixels of the depth maps
  uint32_t neighbor_count = 6;  // [1, 16]; depth maps that a depth map is checked against
  double moved_px_max =
      0.35;  // (0, 10]; a depth map is kept while its points move no further in its sensor views
  double moved_voxels_max =
      0.35;  // (0, 10]; and integrated where it is while they move no further in the world
  double depth_margin = 0.25;           // [0, 10]; depth_range.h
  uint32_t block_pixel_count_min = 16;  // >= 1; pixels, over all maps, that allocate a block
  uint32_t block_map_count_min =
      2;  // >= 1; and maps: what one alone sees is no surface (extraction.h)

  // Told after each piece: stage, pieces looked at, pieces in all. May be empty.
  std::function<void(std::string_view stage, size_t done, size_t total)> progress;

  Status Check() const;  // the first violated bound, named with its value
};

struct StageCount {
  uint64_t computed = 0, kept = 0, removed = 0;
  uint64_t units =
      0;  // depth stages: pixels with a depth made now; volume: blocks changed; others: 0
  double ms = 0;
};

// A photo that got no depth map, and why, for a person.
struct PassedOver {
  ImageId image;
  std::string name, reason;
};

struct DensifyReport {
  DenseSettings settings;
  StageCount depths, checks, volume, solutions, meshes, exposures, colors;
  std::vector<PassedOver> without_depth;  // ascending images
  uint64_t triangles = 0, vertices = 0, tiles = 0;
};

// device  null: C++ on the pool. The result is the same, bit for bit.
//
// The only writer of the database while it runs; readers go on, on their snapshots. Every piece (a
// depth map, a tile) is a transaction: after a crash or a stop (kCancelled) the next call goes on,
// to the same bytes. Deterministic at any number of threads. Memory: the sparse points, some 50
// views, one tile with its surroundings, the tiles that one tile is coloured among; of the area,
// some 100 bytes a tile and 30 a block. kNotFound, kInvalidArgument: LoadScene; bad options. Other
// errors: of the database, the device, a damaged photo.
Result<DensifyReport> Densify(Database& database, ReconstructionId reconstruction,
                              const DensifyOptions& options, Device* device, ThreadPool& pool,
                              std::stop_token stop);

// Deletes what belongs to reconstructions that were merged away; how many of these went.
Result<uint64_t> SweepMerged(Database& database);

}  // namespace veduta
