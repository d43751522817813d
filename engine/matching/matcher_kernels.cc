// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/matcher_kernels.h"

#include "storage/base/cpu_isa.h"

namespace veduta {
namespace {

CpuVariants<MatcherKernels> Variants() {
  return {.portable = kMatcherKernelsPortable,
          .avx2 = kMatcherKernelsAvx2,
          .avx512_vnni = kMatcherKernelsAvx512Vnni};
}

}  // namespace

const MatcherKernels* FindMatcherKernels(CpuIsa isa) {
  return Variants().Find(isa);
}

const MatcherKernels& BestMatcherKernels() {
  return Variants().Best();
}

}  // namespace veduta
