// SPDX-License-Identifier: Apache-2.0
#pragma once
// How many files this process may have open at once.

#include <sys/resource.h>

#include <cstdint>

namespace veduta {

// Raises this process's soft limit to the hard one. A large database needs more than the usual
// 1,024. Where it fails, the limit stays.
inline void AllowManyOpenFiles() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  (void)setrlimit(RLIMIT_NOFILE, &limit);
}

// The soft limit; 1,024, the usual one, where the system does not say.
inline uint64_t OpenFilesAllowed() {
  rlimit limit{};
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_cur : 1024;
}

}  // namespace veduta
