// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within kernels/: the three steps of total variation in C++ on one block, as kernels of one isa
// each (storage/base/cpu_isa.h). Plain data, no templates: the files that define them are compiled
// for wider vectors than the rest of the program.

#include <cstdint>

namespace veduta {

// tau sigma |grad|^2 = 1 (Chambolle and Pock 2011), with |grad|^2 < 12 in three dimensions. This
// tau suits a start near the minimum: 0.25 and 0.05 took half as many iterations again.
inline constexpr float kTvTau = 0.1f, kTvSigma = 1.f / (12.f * 0.1f);

// Pointers to voxel 0. Kernels may read 16 floats before and behind each array.
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

struct TvKernels {
  void (*dual)(const TvArrays& arrays, uint32_t block);
  void (*primal)(const TvArrays& arrays, uint32_t block);
  TvBlockEnergy (*energy)(const TvArrays& arrays, uint32_t block);
};

// Each is defined in its own file; the vector ones are null off x86-64.
extern const TvKernels* const kTvKernelsPortable;
extern const TvKernels* const kTvKernelsAvx2;
extern const TvKernels* const kTvKernelsAvx512;

}  // namespace veduta
