// SPDX-License-Identifier: Apache-2.0
#pragma once
// Ctrl-C as a request: the first lets the photo at hand finish, the second ends the process (which
// loses nothing).

#include <csignal>
#include <stop_token>
#include <thread>

namespace veduta {

// Make it before any other thread: they inherit the blocked signals.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  sigset_t signals_;
  std::stop_source source_;
  std::jthread waiter_;
};

}  // namespace veduta
