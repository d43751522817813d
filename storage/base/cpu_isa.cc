// SPDX-License-Identifier: Apache-2.0
#include "storage/base/cpu_isa.h"

#include <algorithm>
#include <atomic>

namespace veduta {
namespace {

CpuIsa AskProcessor() {
#if defined(__x86_64__)
  // The builtins also ask whether the operating system saves the wide registers.
  if (!__builtin_cpu_supports("avx2")) return CpuIsa::kPortable;
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512vl")) {
    return CpuIsa::kAvx2;
  }
  return __builtin_cpu_supports("avx512vnni") ? CpuIsa::kAvx512Vnni : CpuIsa::kAvx512;
#else
  return CpuIsa::kPortable;
#endif
}

std::atomic<CpuIsa>& Limit() {
  static std::atomic<CpuIsa> limit = CpuIsa::kAvx512Vnni;
  return limit;
}

}  // namespace

const char* CpuIsaName(CpuIsa isa) {
  switch (isa) {
    case CpuIsa::kPortable:
      return "portable";
    case CpuIsa::kAvx2:
      return "avx2";
    case CpuIsa::kAvx512:
      return "avx512";
    case CpuIsa::kAvx512Vnni:
      return "avx512vnni";
  }
  return "unknown";
}

CpuIsa BestCpuIsa() {
  static const CpuIsa of_processor = AskProcessor();
  return std::min(of_processor, Limit().load(std::memory_order_relaxed));
}

CpuIsaLimit::CpuIsaLimit(CpuIsa most) : before_(Limit().load()) {
  Limit().store(std::min(before_, most));
}

CpuIsaLimit::~CpuIsaLimit() {
  Limit().store(before_);
}

}  // namespace veduta
