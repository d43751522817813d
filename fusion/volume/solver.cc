// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/solver.h"

#include <algorithm>

#include "fusion/volume/tile_problem.h"
#include "kernels/total_variation.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

std::vector<float> StartOf(std::span<const TileBlock> blocks, ThreadPool& pool) {
  std::vector<float> u(blocks.size() * kBlockVoxels);
  pool.ParallelFor(blocks.size(), [&](size_t b) {
    for (size_t i = 0; i < kBlockVoxels; ++i) {
      const SolutionBlock* previous = blocks[b].previous;
      u[b * kBlockVoxels + i] =
          previous
              ? static_cast<float>(std::max<int>(previous->value[i], -kSolutionOne)) / kSolutionOne
              : MeanOf(*blocks[b].histogram, i);
    }
  });
  return u;
}

// [3 x blocks x 4096]; empty if no block was solved before.
std::vector<float> DualStartOf(std::span<const TileBlock> blocks) {
  if (std::none_of(blocks.begin(), blocks.end(),
                   [](const TileBlock& b) { return b.previous != nullptr; }))
    return {};
  std::vector<float> p(3 * blocks.size() * kBlockVoxels, 0.f);
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t b = 0; b < blocks.size(); ++b) {
      if (!blocks[b].previous) continue;
      const auto& dual = blocks[b].previous->dual[axis];
      float* along = p.data() + (axis * blocks.size() + b) * kBlockVoxels;
      for (size_t i = 0; i < kBlockVoxels; ++i) along[i] = static_cast<float>(dual[i]) / kDualOne;
    }
  }
  return p;
}

}  // namespace

Status SolverOptions::Check() const {
  return OptionBounds()
      .AboveUpTo("lambda", lambda, 0, 100)
      .Between("iterations_max", iterations_max, 1, 100'000)
      .Between("check_every", check_every, 1, 10'000)
      .Require("gap_max", gap_max, gap_max >= 0 && gap_max < 1, "0 or more and less than 1")
      .status();
}

Result<TileSolution> SolveTile(const GridPlace& tile, std::span<const TileBlock> blocks,
                               const SolverOptions& options, Device* device, ThreadPool& pool,
                               const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckTileBlocks(tile, blocks));
  TileSolution solution;
  if (std::none_of(blocks.begin(), blocks.end(),
                   [&](const TileBlock& b) { return IsInTile(b.index, tile); })) {
    return solution;
  }
  const auto lambda_of_weight = static_cast<float>(options.lambda / kVoteWeightMax);
  VEDUTA_ASSIGN_OR_RETURN(
      const std::unique_ptr<TotalVariation> minimisation,
      TotalVariation::Start(MakeTileProblem(tile, blocks, lambda_of_weight, pool),
                            StartOf(blocks, pool), DualStartOf(blocks), device, pool));
  const auto report = [&]() -> Status {
    VEDUTA_ASSIGN_OR_RETURN(const TvEnergy energy, minimisation->Energy());
    solution.energies.push_back({solution.iterations, energy.primal, energy.dual});
    return Status::Ok();
  };
  VEDUTA_RETURN_IF_ERROR(report());
  while (solution.iterations < options.iterations_max) {
    if (stop.stop_requested()) return Status::Cancelled("the fusion was stopped on request");
    const uint32_t count =
        std::min(options.check_every, options.iterations_max - solution.iterations);
    VEDUTA_RETURN_IF_ERROR(minimisation->Iterate(count));
    solution.iterations += count;
    VEDUTA_RETURN_IF_ERROR(report());
    const EnergyReport& now = solution.energies.back();
    if (options.gap_max > 0 && now.energy - now.lower_bound <= options.gap_max * now.energy) break;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<float> u, minimisation->Read());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<float> p, minimisation->ReadDual());
  solution.blocks = KeepOwnBlocks(tile, blocks, u, p);
  return solution;
}

Result<TileSolution> AverageTile(const GridPlace& tile, std::span<const TileBlock> blocks) {
  VEDUTA_RETURN_IF_ERROR(CheckTileBlocks(tile, blocks));
  std::vector<float> u(blocks.size() * kBlockVoxels);
  for (size_t b = 0; b < blocks.size(); ++b) {
    for (size_t i = 0; i < kBlockVoxels; ++i)
      u[b * kBlockVoxels + i] = MeanOf(*blocks[b].histogram, i);
  }
  TileSolution solution;
  solution.blocks = KeepOwnBlocks(tile, blocks, u, {});
  return solution;
}

}  // namespace veduta
