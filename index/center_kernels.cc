// SPDX-License-Identifier: Apache-2.0
#include "index/center_kernels.h"

#include "storage/base/cpu_isa.h"

namespace veduta {
namespace {

CpuVariants<CenterKernels> Variants() {
  return {.portable = kCenterKernelsPortable,
          .avx2 = kCenterKernelsAvx2,
          .avx512_vnni = kCenterKernelsAvx512Vnni};
}

}  // namespace

const CenterKernels* FindCenterKernels(CpuIsa isa) {
  return Variants().Find(isa);
}

const CenterKernels& BestCenterKernels() {
  return Variants().Best();
}

int32_t CenterBias(const uint8_t* center) {
  int32_t bias = 0;
  for (int j = 0; j < kCenterSize; ++j) bias += center[j] * (center[j] - 256);
  return bias;
}

int32_t DescriptorNorm(const uint8_t* descriptor) {
  int32_t norm = 0;
  for (int j = 0; j < kCenterSize; ++j) norm += descriptor[j] * descriptor[j];
  return norm;
}

}  // namespace veduta
