// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/retrieval/memory_peak.h"

#include <malloc.h>

#include <fstream>
#include <string>

namespace veduta::bench {
namespace {

// A line such as "VmHWM:   123456 kB".
double StatusMb(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name)) return std::stod(line.substr(name.size())) * 1.024e-3;
  }
  return 0;
}

}  // namespace

void ResetMemoryPeak() {
  malloc_trim(0);  // else what was given back to the allocator counts still
  std::ofstream("/proc/self/clear_refs") << "5";
}

double MemoryPeakMb() {
  return StatusMb("VmHWM:");
}

double MemoryNowMb() {
  return StatusMb("VmRSS:");
}

}  // namespace veduta::bench
