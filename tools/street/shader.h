// SPDX-License-Identifier: Apache-2.0
#pragma once
// Shades sixteen rays at a time: where a ray meets its plane, and the colour of the texture there.
//
// One source (shader_kernels.inc) is compiled for each isa (storage/base/cpu_isa.h). All use the
// same IEEE operations in the same order without contraction, so all give the same bits.

#include <cstdint>

#include "tools/street/surface.h"

namespace veduta {
enum class CpuIsa : uint8_t;  // storage/base/cpu_isa.h
}

namespace veduta::street {

inline constexpr int kLanes = 16;

struct alignas(64) ShadeInput {
  float direction[3][kLanes];      // world; its component along the camera's axis is 1
  const Surface* surface[kLanes];  // null: the sky
  float origin[3];                 // the camera's centre, world, m
  float pixel_angle;  // size of a sample at distance 1: 1 / focal length in px / supersampling
};

struct alignas(64) ShadeOutput {
  float rgb[3][kLanes];  // linear
  float depth[kLanes];   // along the camera's axis, m; 0 for the sky
};

// Sensor and development: gains, a square-root tone curve, noise of `noise_sigma` grey levels,
// rounding.
struct ToneInput {
  const float* linear;  // [count x 3], interleaved
  uint8_t* out;         // [count x 3]
  uint32_t count;       // pixels
  uint32_t first;  // index of the first pixel in the photo: the noise is a function of it and of
                   // the seed
  float gain[3];
  float noise_sigma;
  uint32_t seed;
};

struct ShaderKernels {
  void (*shade)(const ShadeInput&, ShadeOutput&);
  void (*tone)(const ToneInput&);
};

// The kernels written for exactly this isa; null where there are none, or the processor lacks it.
const ShaderKernels* FindShaderKernels(CpuIsa isa);
// The fastest that this processor can run. Thread-safe.
const ShaderKernels& BestShaderKernels();

// Indexed by Material.
extern const MaterialLook kMaterialLooks[static_cast<int>(Material::kCount)];

// Each is defined in its own file; the vector ones are null off x86-64.
extern const ShaderKernels* const kShaderKernelsPortable;
extern const ShaderKernels* const kShaderKernelsAvx2;
extern const ShaderKernels* const kShaderKernelsAvx512;

}  // namespace veduta::street
