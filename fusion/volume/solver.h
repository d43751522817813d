// SPDX-License-Identifier: Apache-2.0
#pragma once
// The TV-L1 fusion of one tile: the u that minimises
//
//   E(u) = sum |grad u| + lambda sum_j n_j |u - c_j|     over u in [-1, 1], voxels as unit of
//   length,
//
// where voxel by voxel n_j and c_j are the histogram's weights and centres, and grad is taken
// between voxels that somebody saw (so nothing is made up where nobody looked). E is convex:
// whatever the start, the minimum is the same. Sources: C. Zach, T. Pock, H. Bischof, A globally
// optimal algorithm for robust TV-L1 range image integration, ICCV 2007; A. Chambolle, T. Pock, A
// first-order primal-dual algorithm for convex problems, JMIV 2011, algorithm 1.

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "fusion/volume/grid.h"
#include "fusion/volume/solution.h"
#include "fusion/volume/tile_block.h"
#include "storage/base/option_fields.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

class Device;  // kernels/device.h; null: the C++ path

// Part of the version of every tile's fused signed distance: raise it whenever a change of the code
// changes what SolveTile returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kSolverVersion = 1;

struct SolverOptions {
  // (0, 100], of a map of full weight. tools/bench/fusion: 0.75 is smoother, 3 more complete.
  double lambda = 1.0;
  // [1, 100000]. Rendered streets take 100 to 250.
  uint32_t iterations_max = 400;
  // [1, 10000]. Iterations between two looks at the energy. Chosen by hand; not measured.
  uint32_t check_every = 20;
  // [0, 1). Stops when the energy is proven to lie within this share of the minimum. That leaves
  // 1 % of the vertices more than 0.02 voxels off (see below).
  double gap_max = 1e-3;

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(SolverOptions, lambda, iterations_max, check_every, gap_max)

struct EnergyReport {
  uint32_t iteration = 0;
  double energy = 0;       // of the tile and its halo
  double lower_bound = 0;  // of the dual problem: the minimum is not below
};

struct TileSolution {
  std::vector<SolvedBlock> blocks;     // the tile's own, ascending; the halo is left to its owners
  std::vector<EnergyReport> energies;  // at the start and every check_every iterations
  uint32_t iterations = 0;
};

// Minimises E over `blocks` (the tile's and the halo's, ascending, each once), with natural
// boundaries where no block is or nobody looked, and returns the tile's own part. A tile without
// blocks of its own gives no blocks.
//
// Pure and deterministic: the same bytes on the device, on any instruction set and at any number of
// threads. Thread-safe. Some 100 bytes for each voxel of `blocks` while it runs: 90 MB at most.
// kInvalidArgument on bad options, blocks out of reach, out of order or without a histogram;
// kIoError if the device fails; kCancelled after a stop request, looked at with the energy.
Result<TileSolution> SolveTile(const GridPlace& tile, std::span<const TileBlock> blocks,
                               const SolverOptions& options, Device* device, ThreadPool& pool,
                               const std::stop_token& stop = {});

// The peer: every voxel the weighted mean of its votes (Curless and Levoy, SIGGRAPH 1996), voxels
// without votes 0. Errors as SolveTile.
Result<TileSolution> AverageTile(const GridPlace& tile, std::span<const TileBlock> blocks);

}  // namespace veduta
