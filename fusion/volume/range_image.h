// SPDX-License-Identifier: Apache-2.0
#pragma once
// A depth map made ready for fusion: how far a point lies in front of what the camera saw.

#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/volume/grid.h"
#include "storage/base/status.h"
#include "storage/model/depth_map.h"
#include "storage/model/view.h"

namespace veduta {

// Part of the version of every checked depth map and histogram: raise it whenever a change of the
// code changes votes or the blocks that are named (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kRangeImageVersion = 2;

// A block that a depth map puts surface into, and by how many of its pixels.
struct NamedBlock {
  GridPlace block;
  uint32_t pixel_count = 0;
  bool operator==(const NamedBlock&) const = default;
};

// What one map says about one point.
struct RangeVote {
  // Distance of the point from the tangent plane of the surface that its pixel sees, world units:
  // positive in front, negative behind. Where the surface is plane, at any angle: 0 is exact, the
  // rest to 1 %.
  double distance = 0;
  uint32_t weight = 0;  // 1 to kVoteWeightMax
};
// Chosen by hand; not measured.
inline constexpr uint32_t kVoteWeightMax = 4;

class RangeImage final {
 public:
  // Keeps inverse depths (linear across a plane, so they are interpolated) and, by least squares
  // over 7x7 pixels, the plane that each pixel lies on. Deterministic; single-threaded; some 50 ns
  // and 9 bytes for each pixel. kInvalidArgument if sizes disagree, a depth is negative or not
  // finite, or the camera is degenerate.
  static Result<RangeImage> Make(const DepthMap& map, const ViewGeometry& geometry);

  // The vote on a point of the world; none where the camera does not look, depth is not known, a
  // pixel is wider than 2 voxels at the point, or the point lies over `truncation` behind the
  // surface. A pixel's confidence, its width in voxels and the surface's tilt make the weight.
  // Depths across a jump (over 3 %) are not interpolated. Thread-safe.
  std::optional<RangeVote> VoteOn(const Eigen::Vector3d& point_in_world,
                                  const VolumeGrid& grid) const;

  // Whether any voxel of the block might get a vote: if not, Integrate would change nothing.
  // Conservative and quick: the block's bounding sphere against the frustum and the farthest depth.
  bool MaySee(const GridPlace& block, const VolumeGrid& grid) const;

  // The blocks within the truncation band of any depth sample, ascending: this map's evidence of
  // where surface is. Pixels wider than 2 voxels, and what lies beyond kBlockCoordinateMax, name
  // nothing. A stray pixel names a block too, so whoever allocates may ask for some pixels (8, over
  // all maps, say). Deterministic; single-threaded; O(pixels), some 30 ns each.
  std::vector<NamedBlock> BlocksNearSurface(const VolumeGrid& grid) const;

  uint64_t size_bytes() const { return 9 * uint64_t{confidence_.size()}; }

 private:
  RangeImage() = default;
  double WeightOf(size_t pixel, double depth, const VolumeGrid& grid) const;

  ViewGeometry geometry_;
  Eigen::Matrix3d rotation_;          // cam_from_world
  float depth_max_ = 0;               // 0: the map is empty
  std::vector<float> inverse_depth_;  // [height x width]; 0: not known
  std::vector<float>
      tilt_;  // [height x width]; distance to the tangent plane per difference of depth
  std::vector<uint8_t> confidence_;  // [height x width]
};

}  // namespace veduta
