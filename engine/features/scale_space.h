// SPDX-License-Identifier: Apache-2.0
#pragma once
// The Gaussian scale space of a photo, made row by row, and its extrema. Lowe 2004, section 3.
//
// Level 3's every second pixel is the next octave's level 0. A few rows of each level are made,
// then of the next, so that rows are blurred while they are in the cache; levels 1 to 3, which
// orientations and descriptors read, are kept whole, the others in rings of rows.

#include <memory>
#include <vector>

#include "engine/features/base_rows.h"
#include "engine/features/extremum_scan.h"
#include "engine/features/octave.h"

namespace veduta {

// Holds its memory from photo to photo. Not thread-safe.
class ScaleSpace final {
 public:
  // Builds the octaves of a photo and appends their extrema in (octave, row, level, column) order.
  // The options and the image have been checked. Throws std::bad_alloc.
  void Build(const GrayView& image, const FeatureOptions& options, const SiftKernels& kernels,
             std::vector<Extremum>* extrema);

  // Level 1 to kScalesPerOctave of an octave built, valid until the next Build. Rows are readable
  // kRowPad values beyond the width.
  GrayPlane Plane(int octave, int level) const;

 private:
  struct OctaveMemory {
    GrayBuffer base, kept[kScalesPerOctave];
    OctaveRows rows;
  };

  void PlaceRows(int octave);
  void BuildOctave(int octave, std::vector<Extremum>* extrema);
  void BlurRows(const OctaveRows& octave, int level, int begin, int end);
  void HalveRows(const OctaveRows& octave, const OctaveRows& next, int begin, int end);

  const SiftKernels* kernels_ = nullptr;
  ExtremumLimits limits_;
  GaussianTaps taps_[kLevels];  // [i] makes level i from level i - 1
  BaseRows base_rows_;
  ExtremumScan scan_;
  std::vector<std::unique_ptr<OctaveMemory>> octaves_;
  int octave_count_ = 0;
  GrayBuffer
      rings_[3];      // level 0 of the first octave, and the two last levels of the one being built
  GrayBuffer lines_;  // rows between the two passes of a blur
};

}  // namespace veduta
