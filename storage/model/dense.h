// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the dense pass keeps: depth maps, histograms of signed distances, surfaces. Each artefact
// has a version, a hash of everything that it was computed from.

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/grid_place.h"

namespace veduta {

inline constexpr uint32_t kTileBlockCount = 64;  // blocks in a tile, numbered x + 4 y + 16 z

// One for each reconstruction: what its depth maps and tiles are made with, until somebody asks for
// something else.
struct DenseSettings {
  ReconstructionId reconstruction;
  double voxel_size = 0;       // edge, world units; it is the grid
  uint32_t depth_side_px = 0;  // longer side of a depth map; 0: that of the photo
  uint32_t sensor_count = 0;   // sensor views of each key view
  bool operator==(const DenseSettings&) const = default;
};

// A surface on another grid is made beside the one that is there, under the reconstruction's id
// with this bit set (FORMAT.md, "tile_record"). No reconstruction has such an id.
inline constexpr uint32_t kStagedSurfaceBit = 1u << 31;
constexpr ReconstructionId StagedSurfaceOf(ReconstructionId reconstruction) {
  return ReconstructionId(reconstruction.value | kStagedSurfaceBit);
}
constexpr ReconstructionId OwnerOfSurface(ReconstructionId surface) {
  return ReconstructionId(surface.value & ~kStagedSurfaceBit);
}

struct SensorPose {
  ImageId image;
  Rigid3 cam_from_world;  // as used, which need not be the current pose
};

// The newest depth map of an image, and what it was made from.
struct DepthRecord {
  ImageId image;
  ReconstructionId reconstruction;
  uint64_t version = 0;
  uint64_t geometry_version = 0;  // of the reconstruction when it was made
  uint32_t width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px of this size
  Rigid3 cam_from_world;                  // as used
  double depth_near = 0, depth_far = 0;   // world units; the codes of its pixels span it
  std::vector<SensorPose> sensors;        // best first
  uint32_t known_count = 0;               // pixels that have a depth
  uint64_t checked_version = 0;           // of its CheckedDepthRecord; 0: none yet
  std::array<float, 3> gain{};            // exposure, multiplies linear light; 0: not yet known
  uint64_t exposure_version = 0;          // of the gain
};

struct DepthVersion {
  ImageId image;
  uint32_t reserved = 0;
  uint64_t version = 0;
  auto operator<=>(const DepthVersion&) const = default;
};

struct SeenBlock {
  GridPlace place;
  uint32_t pixel_count = 0;  // that put surface there
  bool operator==(const SeenBlock&) const = default;
};

// A depth map after the check against its neighbors: what is integrated into the volume.
struct CheckedDepthRecord {
  ImageId image;
  ReconstructionId reconstruction;
  uint64_t version = 0;
  uint32_t width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  Rigid3 cam_from_world;
  double depth_near = 0, depth_far = 0;
  uint32_t known_count = 0;
  std::vector<DepthVersion>
      neighbors;  // key views it was checked against, by their depth maps; best first
  std::vector<SeenBlock> blocks;  // in which it sees a surface; ascending places
};

struct DepthPixels {
  std::vector<uint16_t>
      codes;  // [height x width] 0: not known; else 1 (far) to 65535 (near), even in inverse depth
  std::vector<uint8_t> confidence;  // [height x width] 0 (none) to 255
};

// A tile and the versions of its parts; 0 where a part is not there.
struct TileRecord {
  ReconstructionId reconstruction;
  GridPlace place;
  uint64_t blocks = 0;               // bit i: block i is allocated
  std::vector<DepthVersion> depths;  // checked ones, integrated; ascending
  uint64_t volume_version = 0;
  uint64_t histogram_version =
      0;  // changes only with the histograms: a map may see a tile and say nothing
  uint64_t first_round_version = 0, solution_version = 0, mesh_version = 0, color_version = 0;
  uint64_t triangle_count = 0, vertex_count = 0;
};

// Parts of a tile's surface, as fusion/ serializes them. Values are stored: append only, never
// renumber.
enum class SurfacePart : uint8_t {
  kSolution = 1,
  kMesh = 2,
  kColors = 3,
  kFirstRound = 4,  // the solution before that of the neighbors was known
};

}  // namespace veduta
