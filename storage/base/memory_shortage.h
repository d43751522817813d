// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where exceptions end: the standard library and others throw when memory is short, and the
// project's functions return a Status.

#include <exception>
#include <stdexcept>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// What `work` returns, a Status or a Result. kNoMemory where it throws; the message begins "there
// is not enough memory to " and goes on with `purpose`, a verb and what it acts on. What was looked
// up and is not there is no shortage: kCorruption. For work whose libraries throw nothing else.
// `work` must leave nothing half done that is used later. Thread-safe.
template <typename Work>
auto CatchShortage(const std::string& purpose, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::out_of_range& e) {
    return Status::Corruption("an invariant is broken, and so it failed to " + purpose + ": " +
                              e.what());
  } catch (const std::exception& e) {
    return Status::NoMemory("there is not enough memory to " + purpose + ": " + e.what());
  }
}

}  // namespace veduta
