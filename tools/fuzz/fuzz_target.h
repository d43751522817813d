// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a fuzz target defines. The same two functions are run by libFuzzer (clang) and by
// run_target.cc (any compiler): docs/fuzzing.md.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"

// Must neither crash nor abort, whatever the bytes are. Returns 0.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace veduta::fuzz {

// Inputs that the target accepts, to begin from. The same ones at every call.
std::vector<std::string> Seeds();

inline std::string_view Text(const uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}
inline std::string Text(const std::vector<uint8_t>& bytes) {
  return {bytes.begin(), bytes.end()};
}

// Aborts, naming what was promised, where a promise about an accepted input does not hold.
inline void Expect(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}
inline void Expect(const Status& status, const char* promise) {
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.message().c_str());
  Expect(status.ok(), promise);
}

}  // namespace veduta::fuzz
