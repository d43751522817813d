// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/tile_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr int kFilledFacesMin =
    4;  // of 6: holes are filled, the seen is not carried on into the unseen

static_assert(kTvBlockVoxels == kBlockVoxels && kTvRow == kBlockSide && kTvBins == kHistogramBins);

// The place of a block among the ascending `blocks`; -1: it is not there.
int32_t Find(std::span<const TileBlock> blocks, const GridPlace& index) {
  const auto found = std::lower_bound(
      blocks.begin(), blocks.end(), index,
      [](const TileBlock& block, const GridPlace& at) { return block.index < at; });
  return found != blocks.end() && found->index == index
             ? static_cast<int32_t>(found - blocks.begin())
             : -1;
}

void FillBlock(const HistogramBlock& histogram, size_t block, TvProblem* problem) {
  for (size_t bin = 0; bin < kHistogramBins; ++bin) {
    const HistogramBlock::Plane& counts = histogram.counts[bin];
    std::copy(counts.begin(), counts.end(),
              problem->weights.begin() + (block * kHistogramBins + bin) * kBlockVoxels);
    if (bin == kNearBins) continue;
    uint8_t* centers = problem->centers.data() + (block * kNearBins + bin) * kBlockVoxels;
    for (size_t i = 0; i < kBlockVoxels; ++i) {
      constexpr uint32_t scale = kTvCenterLevels / kLevels;
      const uint32_t count = counts[i];
      // (sum / count + 1/2) scale, rounded; at most 248.
      if (count > 0)
        centers[i] = static_cast<uint8_t>((scale * (2u * histogram.sums[bin][i] + count) + count) /
                                          (2 * count));
    }
  }
}

// Holds observed voxels that lie farther than kFreeHalo from the tile where `border` has them: data
// so heavy that nothing moves it, to 1/500 of the truncation.
void HoldBorder(const GridPlace& tile, const TileBlock& block, size_t number, TvProblem* problem) {
  const GridPlace low = FirstBlock(tile);
  const auto distance = [](int32_t at, int32_t from) {
    return std::max({from - at, at - (from + kTileSide - 1), 0});
  };
  for (int32_t i = 0; i < kBlockVoxels; ++i) {
    const int32_t x = distance(block.index.x * kBlockSide + i % kBlockSide, low.x * kBlockSide);
    const int32_t y =
        distance(block.index.y * kBlockSide + i / kBlockSide % kBlockSide, low.y * kBlockSide);
    const int32_t z =
        distance(block.index.z * kBlockSide + i / (kBlockSide * kBlockSide), low.z * kBlockSide);
    if (std::max({x, y, z}) <= kFreeHalo || SupportOf(*block.histogram, i) == 0) continue;
    for (size_t bin = 0; bin < kHistogramBins; ++bin)
      problem->weights[(number * kHistogramBins + bin) * kBlockVoxels + i] = 0;
    // In parts of a bin's 1/256, from -1 on; the last bin is at 1 and has none.
    constexpr int32_t parts = kNearBins * static_cast<int32_t>(kTvCenterLevels);
    const int32_t part = (block.border->value[i] + kSolutionOne) * parts / (2 * kSolutionOne);
    const size_t bin = part / kTvCenterLevels;
    problem->weights[(number * kHistogramBins + bin) * kBlockVoxels + i] = UINT16_MAX;
    if (bin < kNearBins) {
      problem->centers[(number * kNearBins + bin) * kBlockVoxels + i] =
          static_cast<uint8_t>(part % kTvCenterLevels);
    }
  }
}

// What observed voxels on the faces of an unobserved one say on average; 0 where fewer than four
// are there. So a voxel that all maps missed by chance is no hole in the surface.
class UnobservedFiller {
 public:
  UnobservedFiller(std::span<const TileBlock> blocks, std::span<const float> u)
      : blocks_(blocks), u_(u) {}

  float ValueAt(size_t block, int32_t voxel) const {
    float sum = 0;
    int count = 0;
    for (int side = 0; side < 6; ++side) {
      std::array<int32_t, 3> at = {voxel % kBlockSide, voxel / kBlockSide % kBlockSide,
                                   voxel / (kBlockSide * kBlockSide)};
      at[side / 2] += side % 2 == 0 ? -1 : 1;
      GridPlace index = blocks_[block].index;
      int32_t* const along[3] = {&index.x, &index.y, &index.z};
      const int32_t step = FloorDivide(at[side / 2], kBlockSide);
      *along[side / 2] += step;
      at[side / 2] -= step * kBlockSide;
      const int32_t other = step == 0 ? static_cast<int32_t>(block) : Find(blocks_, index);
      const size_t offset = VoxelOffset(at[0], at[1], at[2]);
      if (other < 0 || SupportOf(*blocks_[other].histogram, offset) == 0) continue;
      sum += u_[other * static_cast<size_t>(kBlockVoxels) + offset];
      ++count;
    }
    return count < kFilledFacesMin ? 0.f : sum / static_cast<float>(count);
  }

 private:
  std::span<const TileBlock> blocks_;
  std::span<const float> u_;
};

}  // namespace

Status CheckTileBlocks(const GridPlace& tile, std::span<const TileBlock> blocks) {
  for (size_t i = 0; i < blocks.size(); ++i) {
    const GridPlace& at = blocks[i].index;
    const char* wrong = !IsInReach(at, tile)                   ? "is out of the tile's reach"
                        : i > 0 && !(blocks[i - 1].index < at) ? "is not in ascending order"
                        : blocks[i].histogram == nullptr       ? "has no histogram"
                        : blocks[i].border != nullptr && IsInTile(at, tile)
                            ? "is the tile's own and has a border"
                            : nullptr;
    if (wrong) {
      return Status::InvalidArgument("block (" + std::to_string(at.x) + ", " +
                                     std::to_string(at.y) + ", " + std::to_string(at.z) + ") " +
                                     wrong);
    }
  }
  return Status::Ok();
}

TvProblem MakeTileProblem(const GridPlace& tile, std::span<const TileBlock> blocks,
                          float lambda_of_weight, ThreadPool& pool) {
  TvProblem problem;
  problem.block_count = static_cast<uint32_t>(blocks.size());
  problem.lambda = lambda_of_weight;
  problem.weights.assign(blocks.size() * kHistogramBins * kBlockVoxels, 0);
  problem.centers.assign(blocks.size() * kNearBins * kBlockVoxels, 0);
  for (const TileBlock& block : blocks) {
    const GridPlace& at = block.index;
    for (const GridPlace& next :
         {GridPlace{at.x - 1, at.y, at.z}, GridPlace{at.x + 1, at.y, at.z},
          GridPlace{at.x, at.y - 1, at.z}, GridPlace{at.x, at.y + 1, at.z},
          GridPlace{at.x, at.y, at.z - 1}, GridPlace{at.x, at.y, at.z + 1}}) {
      problem.neighbors.push_back(Find(blocks, next));
    }
  }
  pool.ParallelFor(blocks.size(), [&](size_t i) {
    FillBlock(*blocks[i].histogram, i, &problem);
    if (blocks[i].border) HoldBorder(tile, blocks[i], i, &problem);
  });
  return problem;
}

float MeanOf(const HistogramBlock& histogram, size_t voxel) {
  float sum = 0, weight = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    const auto count = static_cast<float>(histogram.counts[bin][voxel]);
    if (count == 0) continue;
    sum += count * histogram.CenterOf(bin, voxel);
    weight += count;
  }
  return weight > 0 ? std::clamp(sum / weight, -1.f, 1.f) : 0.f;
}

std::vector<SolvedBlock> KeepOwnBlocks(const GridPlace& tile, std::span<const TileBlock> blocks,
                                       std::span<const float> u, std::span<const float> p) {
  std::vector<SolvedBlock> own;
  const UnobservedFiller filler(blocks, u);
  for (size_t b = 0; b < blocks.size(); ++b) {
    if (!IsInTile(blocks[b].index, tile)) continue;
    auto solution = std::make_unique<SolutionBlock>();
    for (int32_t i = 0; i < kBlockVoxels; ++i) {
      solution->support[i] = SupportOf(*blocks[b].histogram, i);
      const float value = solution->support[i] > 0 ? u[b * kBlockVoxels + i] : filler.ValueAt(b, i);
      solution->value[i] = static_cast<int16_t>(std::lround(value * kSolutionOne));
    }
    for (size_t axis = 0; axis < 3 && !p.empty(); ++axis) {
      const float* along = p.data() + axis * u.size() + b * kBlockVoxels;
      for (size_t i = 0; i < kBlockVoxels; ++i) {
        solution->dual[axis][i] =
            static_cast<int8_t>(std::lround(std::clamp(along[i], -1.f, 1.f) * kDualOne));
      }
    }
    own.push_back({blocks[b].index, std::move(solution)});
  }
  return own;
}

}  // namespace veduta
