// SPDX-License-Identifier: Apache-2.0
#include "tools/street/shader.h"

#include "storage/base/cpu_isa.h"

namespace veduta::street {

// clang-format off
const MaterialLook kMaterialLooks[static_cast<int>(Material::kCount)] = {
    // brick w, h, mortar, contrast, stagger, noise, stain, print, frame
    {0, 0, 0, 0, 0,                  0.080f, 0.30f, 0, 0},           // kPlaster
    {0.26f, 0.085f, 0.014f, 0.55f, 0.5f, 0.050f, 0.22f, 0, 0},       // kBrick
    {0.62f, 0.31f, 0.018f, 0.30f, 0.5f, 0.075f, 0.30f, 0, 0},        // kAshlar
    {0, 0, 0, 0, 0,                  0.075f, 0.28f, 0, 0},           // kTrim
    {0, 0, 0, 0, 0,                  0.120f, 0.40f, 0, 0.07f},       // kWindow
    {0.13f, 3.0f, 0.010f, 0.35f, 0,  0.080f, 0.25f, 0, 0.09f},       // kDoor
    {0, 0, 0, 0, 0,                  0.030f, 0.10f, 0.045f, 0.03f},  // kPoster
    {0, 0, 0, 0, 0,                  0.055f, 0.20f, 0, 0},           // kAsphalt
    {0.50f, 0.40f, 0.012f, 0.22f, 0.5f, 0.060f, 0.24f, 0, 0},        // kPavement
    {0.24f, 0.30f, 0.016f, 0.35f, 0.5f, 0.060f, 0.25f, 0, 0},        // kRoof
    {0, 0, 0, 0, 0,                  0.080f, 0.20f, 0, 0},           // kLeaf
    {0, 0, 0, 0, 0,                  0.020f, 0.10f, 0, 0},           // kPaint
};
// clang-format on

namespace {

CpuVariants<ShaderKernels> Variants() {
  return {.portable = kShaderKernelsPortable,
          .avx2 = kShaderKernelsAvx2,
          .avx512 = kShaderKernelsAvx512};
}

}  // namespace

const ShaderKernels* FindShaderKernels(CpuIsa isa) {
  return Variants().Find(isa);
}

const ShaderKernels& BestShaderKernels() {
  return Variants().Best();
}

}  // namespace veduta::street
