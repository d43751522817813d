// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within fusion/volume: a tile's blocks as the total variation kernels want them.

#include <span>
#include <vector>

#include "fusion/volume/tile_block.h"
#include "kernels/total_variation_problem.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// kInvalidArgument on a block out of reach, out of order or without a histogram.
Status CheckTileBlocks(const GridPlace& tile, std::span<const TileBlock> blocks);

TvProblem MakeTileProblem(const GridPlace& tile, std::span<const TileBlock> blocks,
                          float lambda_of_weight, ThreadPool& pool);

// The mean of a voxel's votes, in [-1, 1]; 0 where nobody voted.
float MeanOf(const HistogramBlock& histogram, size_t voxel);

// The tile's own blocks of `u` [blocks x 4096] and of `p` [3 x blocks x 4096] (or none: 0), with
// their support.
std::vector<SolvedBlock> KeepOwnBlocks(const GridPlace& tile, std::span<const TileBlock> blocks,
                                       std::span<const float> u, std::span<const float> p);

}  // namespace veduta
