// SPDX-License-Identifier: Apache-2.0
#pragma once
// What solving a tile reads of each block (solver.h).

#include <cstdint>

#include "fusion/volume/grid.h"
#include "fusion/volume/histogram.h"
#include "fusion/volume/solution.h"

namespace veduta {

// One round suffices where the data are dense: solved to the end, tiles differ from all tiles as
// one problem by more than 0.02 voxels at 0.3 % of the vertices at their borders, less than what
// stopping at gap_max leaves anywhere (1 %). Further rounds (a Schwarz alternating method in Jacobi
// order) bring that to 0.04 %: in round k + 1 a tile reads its neighbours' round k, never their
// round k + 1, so no order of tiles shows. Figures: tools/bench/fusion, --borders.
inline constexpr int32_t kFreeHalo = 8;  // voxels

// One block of the tile or of its halo (IsInReach) that is allocated.
struct TileBlock {
  GridPlace index;
  const HistogramBlock* histogram = nullptr;  // never null
  const SolutionBlock* previous =
      nullptr;  // where to start from; null: from the mean of the histogram
  // For a block of the halo: the neighbour's solution of the round before. Its voxels farther than
  // kFreeHalo from the tile are held there, so that the tile knows what lies behind its halo. null,
  // as in the first round: all are free.
  const SolutionBlock* border = nullptr;
};

}  // namespace veduta
