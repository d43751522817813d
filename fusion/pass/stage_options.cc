// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/stage_options.h"

namespace veduta {
namespace {

// Chosen by hand; not measured. Neighbours need less overlap than sensor views (which have the
// paper's 0.3), because each brings its own depth.
constexpr double kNeighborOverlapMin = 0.1;

}  // namespace

DenseStageOptions StageOptionsOf(const DensifyOptions& options, const DenseSettings& settings) {
  DenseStageOptions stages;
  stages.depths.side_px = settings.depth_side_px;
  stages.depths.sensor_count = settings.sensor_count;
  stages.depths.depth_margin = options.depth_margin;
  stages.checks.neighbor_count = options.neighbor_count;
  stages.checks.neighbors.overlap_min = kNeighborOverlapMin;
  stages.checks.grid.voxel_size = settings.voxel_size;
  stages.volume.grid.voxel_size = settings.voxel_size;
  stages.meshes.grid.voxel_size = settings.voxel_size;
  stages.colors.side_px = settings.depth_side_px;
  stages.colors.coloring.voxel_size = settings.voxel_size;
  stages.colors.grid.voxel_size = settings.voxel_size;
  stages.tolerance = {options.moved_px_max, options.moved_voxels_max};
  stages.allocation = {options.block_pixel_count_min, options.block_map_count_min};
  return stages;
}

}  // namespace veduta
