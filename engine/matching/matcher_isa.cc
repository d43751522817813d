// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/matcher_isa.h"

#include <algorithm>

namespace veduta {

MatcherIsa BestMatcherIsa() {
#if defined(__x86_64__)
  // The builtins also ask whether the operating system saves the wide registers.
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vnni")) {
    return MatcherIsa::kAvx512Vnni;
  }
  if (__builtin_cpu_supports("avx2")) return MatcherIsa::kAvx2;
#endif
  return MatcherIsa::kPortable;
}

const char* MatcherIsaName(MatcherIsa isa) {
  switch (isa) {
    case MatcherIsa::kPortable:
      return "portable";
    case MatcherIsa::kAvx2:
      return "avx2";
    case MatcherIsa::kAvx512Vnni:
      return "avx512vnni";
  }
  return "unknown";
}

const MatcherKernels& MatcherKernelsFor(MatcherIsa isa) {
  static const MatcherIsa best = BestMatcherIsa();
  switch (std::min(isa, best)) {
#if defined(__x86_64__)
    case MatcherIsa::kAvx512Vnni:
      return kAvx512VnniKernels;
    case MatcherIsa::kAvx2:
      return kAvx2Kernels;
#endif
    default:
      return kPortableKernels;
  }
}

}  // namespace veduta
