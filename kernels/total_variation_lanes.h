// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within kernels/: the C++ path's three steps on one block, once per instruction set. Plain data,
// no templates: the files behind this are compiled for wider vectors than the rest of the program.

#include <cstdint>

namespace veduta {

// tau sigma |grad|^2 = 1, with |grad|^2 < 12 in three dimensions. The smaller tau suits what starts
// near its end: 0.25 and 0.05 took half as many iterations again.
inline constexpr float kTvTau = 0.1f, kTvSigma = 1.f / (12.f * 0.1f);

// Pointers to voxel 0; what lies 16 floats before and behind the arrays may be read.
struct TvArrays {
  float *u, *u_bar, *p[3];
  const int32_t* neighbors;
  const uint16_t* weights;
  const uint8_t* centers;
  const uint32_t* bits_of_row;
  float lambda;
};

struct TvBlockEnergy {
  int64_t primal = 0, dual = 0;  // in parts of kTvEnergyOne
};
inline constexpr float kTvEnergyOne = 1048576.f;

struct TvSteps {
  void (*dual)(const TvArrays& arrays, uint32_t block);
  void (*primal)(const TvArrays& arrays, uint32_t block);
  TvBlockEnergy (*energy)(const TvArrays& arrays, uint32_t block);
};
TvSteps TvStepsBaseline();
TvSteps TvStepsAvx2();
TvSteps TvStepsAvx512();

}  // namespace veduta
