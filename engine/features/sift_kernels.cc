// SPDX-License-Identifier: Apache-2.0
#include "engine/features/sift_kernels.h"

#include "storage/base/cpu_isa.h"

namespace veduta {
namespace {

CpuVariants<SiftKernels> Variants() {
  return {.portable = kSiftKernelsPortable, .avx2 = kSiftKernelsAvx2, .avx512 = kSiftKernelsAvx512};
}

}  // namespace

const SiftKernels* FindSiftKernels(CpuIsa isa) {
  return Variants().Find(isa);
}

const SiftKernels& BestSiftKernels() {
  return Variants().Best();
}

}  // namespace veduta
