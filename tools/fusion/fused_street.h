// SPDX-License-Identifier: Apache-2.0
#pragma once
// The volumetric pass over a set of depth maps, all that is large on disk: what `veduta densify`
// does with its database.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "fusion/volume/extraction.h"
#include "fusion/volume/histogram.h"
#include "fusion/volume/solver.h"
#include "tools/fusion/block_files.h"

namespace veduta::fusion_benchmark {

struct SolveReport {
  size_t tiles = 0, blocks_solved = 0;  // with halos
  uint64_t iterations = 0, voxel_iterations = 0;
  double seconds = 0;
  double energy_start = 0, energy_end = 0, lower_bound = 0;
};

class FusedStreet final {
 public:
  FusedStreet(const VolumeGrid& grid, uint32_t pixels_min, ThreadPool& pool)
      : grid_(grid), pixels_min_(pixels_min), pool_(pool) {}

  // First of all maps, then the second of all maps: the blocks must be known before a vote is cast.
  void Name(const RangeImage& image);
  // Returns the blocks that changed.
  std::vector<GridPlace> Add(const RangeImage& image, int sign = 1);

  // Solves every tile; solutions go under `kind`. `previous`: the kind to start from; empty: from
  // the means. `border`: the kind that neighbours' borders are taken from; empty: a first round.
  SolveReport Solve(const char* kind, const std::string& previous, const SolverOptions& options,
                    Device* device, const std::string& border = "") {
    return SolveTiles(tiles(), kind, previous, options, device, border);
  }
  SolveReport SolveTiles(const std::set<GridPlace>& tiles, const char* kind,
                         const std::string& previous, const SolverOptions& options, Device* device,
                         const std::string& border = "");
  void Average(const char* kind);
  // All tiles as one problem, which no border cuts: what tiles are compared with. In memory.
  SolveReport SolveWhole(const char* kind, uint32_t iterations, double lambda);
  // A start for Solve: every voxel -1 to 1 at random (seed > 0), or 0.
  void Scatter(const char* kind, uint64_t seed);
  // The energies of solving one tile.
  std::vector<EnergyReport> EnergiesOf(const GridPlace& tile, const SolverOptions& options,
                                       Device* device);

  // Extracts every tile; the pieces go under `kind`, and their triangles are counted.
  size_t Extract(const char* kind, const ExtractionOptions& options);
  SurfacePiece Weld(const char* kind) const;

  std::vector<GridPlace> blocks() const;  // allocated ones
  std::set<GridPlace> tiles() const;
  const VolumeGrid& grid() const { return grid_; }
  uint64_t histogram_bytes() const { return histogram_bytes_; }
  std::unique_ptr<HistogramBlock> ReadHistogram(const GridPlace& block) const;
  std::unique_ptr<SolutionBlock> ReadSolution(const std::string& kind,
                                              const GridPlace& block) const;
  // The tile's blocks in reach, as SolveTile takes them.
  struct Loaded {
    std::vector<std::unique_ptr<HistogramBlock>> histograms;
    std::vector<std::unique_ptr<SolutionBlock>> previous, border;
    std::vector<TileBlock> blocks;
  };
  Loaded Load(const GridPlace& tile, const std::string& previous,
              const std::string& border = "") const;

 private:
  VolumeGrid grid_;
  uint32_t pixels_min_;
  ThreadPool& pool_;
  std::map<GridPlace, uint32_t> named_;
  uint64_t histogram_bytes_ = 0;
  BlockFiles files_;
};

}  // namespace veduta::fusion_benchmark
