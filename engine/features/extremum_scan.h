// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the extrema of an octave row by row, while its levels are being made.

#include <vector>

#include "engine/features/extremum.h"
#include "engine/features/octave.h"
#include "engine/features/scratch_memory.h"

namespace veduta {

// Rows of all levels that have to exist below a row before it is scanned.
inline constexpr int kScanLag = kRefineReach;

// Not thread-safe; memory is kept from octave to octave.
class ExtremumScan final {
 public:
  // `octave` must live until the scan ends.
  void Start(const SiftKernels& kernels, const OctaveRows* octave, int octave_index,
             const ExtremumLimits& limits);
  // Scans the rows before `end` that are not scanned yet and appends what it finds in (row, level,
  // column) order. With `first` as the first row not scanned yet, rows [first - kRefineReach, end +
  // kRefineReach) of all levels must be in memory, as far as they lie in the octave.
  void ScanTo(int end, std::vector<Extremum>* extrema);

 private:
  static constexpr int kDifferences = kLevels - 1;
  static constexpr int kRing = 4;  // rows of differences kept; three are needed

  int16_t* DifferenceRow(int level, int y) {
    return differences_[level].data() + (y % kRing) * stride_ + kRowPad;
  }

  const SiftKernels* kernels_ = nullptr;
  const OctaveRows* octave_ = nullptr;
  int octave_index_ = 0;
  ExtremumLimits limits_;
  ptrdiff_t stride_ = 0;
  int next_row_ = 0;         // the first not scanned
  int next_difference_ = 0;  // the first row whose differences are not made
  GrayBuffer differences_[kDifferences];
  std::vector<int32_t> columns_;
};

}  // namespace veduta
