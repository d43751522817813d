// SPDX-License-Identifier: Apache-2.0
#include "storage/base/status.h"

#include <cstdio>
#include <cstdlib>

namespace veduta {

void AbortWithMessage(const char* file, int line, const std::string& message) {
  std::fprintf(stderr, "veduta: broken invariant at %s:%d: %s\n", file, line, message.c_str());
  std::abort();
}

}  // namespace veduta
