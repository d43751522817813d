// SPDX-License-Identifier: Apache-2.0
#pragma once
// Gaussian filters as integers: taps that are multiples of 2^-15 and sum to one exactly.

#include <cstdint>

namespace veduta {

inline constexpr int kTapRadiusMax = 60;

struct GaussianTaps {
  int radius = 0;
  int16_t taps[kTapRadiusMax + 2] = {};  // from the center outwards; zero after the last
};

// A symmetric filter whose variance, after truncation at about 3.6 sigma, is sigma^2. sigma in
// [0.3, 16].
GaussianTaps MakeGaussianTaps(double sigma);

struct ShiftedTaps {
  int count = 0;  // odd
  int16_t taps[2 * kTapRadiusMax + 2] = {};
};

// The filter for a position a quarter of a sample before the middle tap. Its mean lies exactly
// there, so doubling an image with it (and with its mirror image for the other half of the samples)
// does not shift the image. sigma in [0.4, 16].
ShiftedTaps MakeQuarterStepTaps(double sigma);

}  // namespace veduta
