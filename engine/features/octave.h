// SPDX-License-Identifier: Apache-2.0
#pragma once
// One octave of the Gaussian scale space. Lowe 2004, section 3: level 0 has blur sigma, level i
// sigma * 2^(i / 3).

#include <cstddef>
#include <cstdint>

#include "engine/features/sift_kernels.h"

namespace veduta {

inline constexpr int kScalesPerOctave = 3;  // Lowe 2004, section 3.1
inline constexpr int kLevels = kScalesPerOctave + 3;
// No extrema are sought within so many px of an octave's border; as in OpenCV's SIFT.
inline constexpr int kExtremumBorder = 5;
// An extremum may lie so many samples from where it was found; as in OpenCV's SIFT.
inline constexpr int kRefineSteps = 5;
inline constexpr int kRefineReach = kRefineSteps + 1;

// The rows of one level that are in memory: row y lies at y modulo the capacity.
struct LevelRows {
  int16_t* data = nullptr;
  ptrdiff_t stride = 0;
  int capacity = 1;

  int16_t* Row(int y) const { return data + (y % capacity) * stride; }
};

struct OctaveRows {
  int width = 0, height = 0;
  LevelRows levels[kLevels];
};

// An extremum of the difference of Gaussians; coordinates in px of its octave.
struct Extremum {
  int octave = 0, level = 0, column = 0, row = 0;  // the nearest sample
  double x = 0, y = 0;
  double level_offset = 0;  // from `level`, [-0.5, 0.5]
  double contrast = 0;  // the difference, in shares of the grey range; positive for dark on bright
};

}  // namespace veduta
