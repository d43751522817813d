// SPDX-License-Identifier: Apache-2.0
#pragma once
// Everything that the stages of the dense pass can be told, one struct for each stage. A stage sees
// no other options, and its struct goes into the version of all that it makes as a whole, together
// with the numbers of the algorithms behind it: so nothing that a stage uses can be left out.

#include <array>
#include <cstdint>

#include "engine/door/dense.h"
#include "fusion/depth/depth_codes.h"
#include "fusion/depth/depth_consistency.h"
#include "fusion/depth/depth_estimation.h"
#include "fusion/depth/sensor_views.h"
#include "fusion/pass/view_loader.h"
#include "fusion/surface/exposure.h"
#include "fusion/surface/vertex_color.h"
#include "fusion/volume/extraction.h"
#include "fusion/volume/solver.h"
#include "storage/base/option_fields.h"
#include "storage/model/dense.h"

namespace veduta {

// Raw depth maps.
struct DepthStageOptions {
  static constexpr const char* kStage = "depth";
  static constexpr std::array kAlgorithms = {kViewVersion, kDepthRangeVersion, kSensorViewsVersion,
                                             kDepthEstimationVersion, kDepthCodesVersion};
  uint32_t side_px = 512;  // longer side of a depth map; 0: the photo's
  uint32_t sensor_count = 2;
  double depth_margin = 0.25;
  SensorViewOptions sensor_views;
  DepthOptions estimation;
};
VEDUTA_OPTION_FIELDS(DepthStageOptions, side_px, sensor_count, depth_margin, sensor_views,
                     estimation)

// Depth maps against each other, and the blocks in which they see a surface.
struct CheckStageOptions {
  static constexpr const char* kStage = "check";
  static constexpr std::array kAlgorithms = {kSensorViewsVersion, kConsistencyVersion,
                                             kDepthCodesVersion, kRangeImageVersion};
  uint32_t neighbor_count = 6;
  SensorViewOptions neighbors;
  ConsistencyOptions consistency;
  VolumeGrid grid;
};
VEDUTA_OPTION_FIELDS(CheckStageOptions, neighbor_count, neighbors, consistency, grid)

// Histograms of tiles.
struct VolumeStageOptions {
  static constexpr const char* kStage = "volume";
  static constexpr std::array kAlgorithms = {kRangeImageVersion, kHistogramVersion};
  VolumeGrid grid;
};
VEDUTA_OPTION_FIELDS(VolumeStageOptions, grid)

// The fused signed distance.
struct FusionStageOptions {
  static constexpr const char* kStage = "fusion";
  static constexpr std::array kAlgorithms = {kSolverVersion};
  SolverOptions solver;
};
VEDUTA_OPTION_FIELDS(FusionStageOptions, solver)

// Triangles.
struct MeshStageOptions {
  static constexpr const char* kStage = "mesh";
  static constexpr std::array kAlgorithms = {kExtractionVersion};
  ExtractionOptions extraction;
  VolumeGrid grid;
};
VEDUTA_OPTION_FIELDS(MeshStageOptions, extraction, grid)

// One gain for each photo.
struct ExposureStageOptions {
  static constexpr const char* kStage = "exposure";
  static constexpr std::array kAlgorithms = {kExposureVersion};
  ExposureOptions exposure;
};
VEDUTA_OPTION_FIELDS(ExposureStageOptions, exposure)

// The colours of the vertices.
struct ColorStageOptions {
  static constexpr const char* kStage = "color";
  static constexpr std::array kAlgorithms = {kViewVersion, kColoringVersion};
  uint32_t side_px = 512;  // longer side of the photos that give colours; 0: as they are
  ColoringOptions coloring;
  VolumeGrid grid;
};
VEDUTA_OPTION_FIELDS(ColorStageOptions, side_px, coloring, grid)

// What decides whether something that was made earlier is still good enough. It goes into no
// version, for no bytes depend on it: it is judged anew in every pass.
struct MovementTolerance {
  double moved_px_max = 0.35;
  double moved_voxels_max = 0.35;
};
VEDUTA_OPTION_FIELDS(MovementTolerance, moved_px_max, moved_voxels_max)

// Which blocks are allocated. It goes into no version itself: the blocks that it allocates do.
struct BlockAllocation {
  uint32_t block_pixel_count_min = 16;
  uint32_t block_map_count_min = 2;
};
VEDUTA_OPTION_FIELDS(BlockAllocation, block_pixel_count_min, block_map_count_min)

struct DenseStageOptions {
  DepthStageOptions depths;
  CheckStageOptions checks;
  VolumeStageOptions volume;
  FusionStageOptions fusion;
  MeshStageOptions meshes;
  ExposureStageOptions exposures;
  ColorStageOptions colors;
  MovementTolerance tolerance;
  BlockAllocation allocation;
};
VEDUTA_OPTION_FIELDS(DenseStageOptions, depths, checks, volume, fusion, meshes, exposures, colors,
                     tolerance, allocation)

// What the door's options and a reconstruction's settings mean for the stages.
DenseStageOptions StageOptionsOf(const DensifyOptions& options, const DenseSettings& settings);

// For the test that flips every field.
VEDUTA_OPTION_FIELDS(DensifyOptions, depth_side_px, sensor_count, voxel_size, voxel_px,
                     neighbor_count, moved_px_max, moved_voxels_max, depth_margin,
                     block_pixel_count_min, block_map_count_min)
VEDUTA_OPTION_FIELDS(DenseSettings, reconstruction, voxel_size, depth_side_px, sensor_count)

}  // namespace veduta
