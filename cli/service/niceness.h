// SPDX-License-Identifier: Apache-2.0
#pragma once
// Threads that let others go first.

#include <sys/resource.h>
#include <unistd.h>

namespace veduta {

// Makes the calling thread nicer to others by so much than it is, as far as the system has numbers;
// threads that it starts from then on are as nice. (setpriority(2): on Linux each thread has a
// niceness of its own.)
inline void BeNicer(int by) {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), getpriority(PRIO_PROCESS, 0) + by);
}

}  // namespace veduta
