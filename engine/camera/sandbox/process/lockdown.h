// SPDX-License-Identifier: Apache-2.0
#pragma once
// A process gives up whatever it does not need to compute: files, network, other processes.

#include <cstdint>
#include <memory>

#include "storage/base/status.h"

namespace veduta {

struct LockdownLimits {
  uint64_t memory_bytes = 0;  // of addresses, besides those that the process has already
  uint32_t cpu_s = 1;         // >= 1
};

// The filter of system calls, by libseccomp. It is made once, and entered by each child of the
// process that made it.
class Lockdown final {
 public:
  // kIoError where the filter cannot be made.
  static Result<Lockdown> Make();

  // For ever, and for the one thread that the process must have: closes all its descriptors, limits
  // its memory and its processor time, and leaves it the system calls by which it gets memory,
  // reads the clock and ends. What would write to a descriptor or ask about one is told that it is
  // closed. Any other call ends the process (SIGSYS), as does memory that may be executed. A
  // smaller limit that the process has already stays. Built with a sanitizer, which takes addresses
  // by the terabyte, it does not limit the memory. kIoError names what the system refused; some of
  // it may have been given up then, so the process should end.
  Status Enter(const LockdownLimits& limits) const;

 private:
  explicit Lockdown(std::shared_ptr<void> filter) : filter_(std::move(filter)) {}

  std::shared_ptr<void> filter_;
};

}  // namespace veduta
