// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/histogram.h"

#include <algorithm>
#include <string>

namespace veduta {
namespace {

constexpr uint8_t kNoBin = 255;
constexpr int32_t kCounterMax = 65535;

// What one map adds to one voxel.
struct Addition {
  uint8_t bin = kNoBin;
  uint8_t weight = 0;
  uint8_t level_sum = 0;  // weight times level; of near bins
};

Addition AdditionOf(const RangeVote& vote, double truncation) {
  const double share = vote.distance / truncation;
  Addition addition;
  addition.weight = static_cast<uint8_t>(vote.weight);
  if (share > 1) {
    addition.bin = kNearBins;
    return addition;
  }
  const int fine_count = kNearBins * kLevels;
  const int fine = std::clamp(static_cast<int>((share + 1) * 0.5 * fine_count), 0, fine_count - 1);
  addition.bin = static_cast<uint8_t>(fine / kLevels);
  addition.level_sum = static_cast<uint8_t>(static_cast<uint32_t>(fine % kLevels) * vote.weight);
  return addition;
}

// The counters of one voxel after an addition; false if one leaves its range or the sum breaks its
// bound.
bool Apply(const Addition& addition, int sign, size_t voxel, HistogramBlock* block) {
  const int32_t count = block->counts[addition.bin][voxel] + sign * addition.weight;
  if (count < 0 || count > kCounterMax) return false;
  if (addition.bin < kNearBins) {
    const int32_t sum = block->sums[addition.bin][voxel] + sign * addition.level_sum;
    const int32_t maps = block->near_maps[voxel] + sign;
    if (sum < 0 || sum > kCounterMax || sum > count * (kLevels - 1) || maps < 0 ||
        maps > kCounterMax)
      return false;
    block->sums[addition.bin][voxel] = static_cast<uint16_t>(sum);
    block->near_maps[voxel] = static_cast<uint16_t>(maps);
  }
  block->counts[addition.bin][voxel] = static_cast<uint16_t>(count);
  return true;
}

// Takes back what was applied: wraps around where Apply would refuse, which restores the bytes.
void Revert(const Addition& addition, int sign, size_t voxel, HistogramBlock* block) {
  block->counts[addition.bin][voxel] =
      static_cast<uint16_t>(block->counts[addition.bin][voxel] - sign * addition.weight);
  if (addition.bin == kNearBins) return;
  block->sums[addition.bin][voxel] =
      static_cast<uint16_t>(block->sums[addition.bin][voxel] - sign * addition.level_sum);
  block->near_maps[voxel] = static_cast<uint16_t>(block->near_maps[voxel] - sign);
}

std::string NameOf(const GridPlace& index) {
  return "block (" + std::to_string(index.x) + ", " + std::to_string(index.y) + ", " +
         std::to_string(index.z) + ")";
}

}  // namespace

bool HistogramBlock::IsEmpty() const {
  for (const Plane& plane : counts) {
    if (std::any_of(plane.begin(), plane.end(), [](uint16_t count) { return count != 0; }))
      return false;
  }
  return true;
}

float HistogramBlock::CenterOf(int bin, size_t voxel) const {
  if (bin == kNearBins) return 1.f;
  const int count = counts[bin][voxel];
  const float level = count == 0 ? 0.5f * (kLevels - 1)
                                 : static_cast<float>(sums[bin][voxel]) / static_cast<float>(count);
  return -1.f + 2.f / kNearBins * (static_cast<float>(bin) + (level + 0.5f) / kLevels);
}

Result<Integration> Integrate(const RangeImage& image, const VolumeGrid& grid,
                              const GridPlace& index, int sign, HistogramBlock* block) {
  VEDUTA_RETURN_IF_ERROR(grid.Check());
  if (sign != 1 && sign != -1)
    return Status::InvalidArgument("sign is " + std::to_string(sign) + ", not 1 or -1");
  std::array<Addition, kBlockVoxels> additions;
  const Eigen::Vector3d origin = Eigen::Vector3d(index.x, index.y, index.z) * kBlockSide;
  Integration result;
  if (!image.MaySee(index, grid)) return result;
  for (int32_t z = 0; z < kBlockSide; ++z) {
    for (int32_t y = 0; y < kBlockSide; ++y) {
      for (int32_t x = 0; x < kBlockSide; ++x) {
        const Eigen::Vector3d center =
            (origin + Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5)) * grid.voxel_size;
        const std::optional<RangeVote> vote = image.VoteOn(center, grid);
        if (vote) additions[VoxelOffset(x, y, z)] = AdditionOf(*vote, grid.truncation());
      }
    }
  }
  for (size_t i = 0; i < kBlockVoxels; ++i) {
    if (additions[i].bin == kNoBin) continue;
    result.changed = true;
    if (Apply(additions[i], sign, i, block)) continue;
    for (size_t j = 0; j < i; ++j) {
      if (additions[j].bin != kNoBin) Revert(additions[j], sign, j, block);
    }
    return Status::InvalidArgument(
        NameOf(index) +
        (sign > 0 ? ": too many maps see one voxel; leave some out or take smaller voxels"
                  : ": the map to withdraw was never added, or with other options; fuse it anew"));
  }
  return result;
}

}  // namespace veduta
