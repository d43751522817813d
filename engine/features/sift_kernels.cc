// SPDX-License-Identifier: Apache-2.0
#include "engine/features/sift_kernels.h"

#include <initializer_list>

namespace veduta {

const SiftKernels* KernelsOf(SimdPath path) {
  switch (path) {
    case SimdPath::kPortable:
      return kSiftKernelsPortable;
#if defined(__x86_64__)
    case SimdPath::kAvx2:
      return __builtin_cpu_supports("avx2") ? kSiftKernelsAvx2 : nullptr;
    case SimdPath::kAvx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                     __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")
                 ? kSiftKernelsAvx512
                 : nullptr;
#endif
    default:
      return nullptr;
  }
}

const SiftKernels& BestKernels() {
  for (SimdPath path : {SimdPath::kAvx512, SimdPath::kAvx2}) {
    if (const SiftKernels* kernels = KernelsOf(path)) return *kernels;
  }
  return *kSiftKernelsPortable;
}

}  // namespace veduta
