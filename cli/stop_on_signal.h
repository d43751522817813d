// SPDX-License-Identifier: Apache-2.0
#pragma once
// Ctrl-C as a request: the first one lets the photo at hand finish, the second one ends the
// process, which loses nothing that was acknowledged.

#include <chrono>
#include <csignal>
#include <stop_token>
#include <thread>

namespace veduta {

// While it lives, SIGINT and SIGTERM are taken by a thread of its own. It is to be made before any
// other thread, so that all of them inherit the blocked signals.
class StopOnSignal final {
 public:
  // `patience`: where it still lives so long after the first signal, the process ends with exit
  // code 0 as by a kill, which loses nothing either. Negative: it waits for ever.
  explicit StopOnSignal(std::chrono::milliseconds patience = std::chrono::milliseconds(-1));
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  // Stop is requested at the first signal.
  std::stop_token token() const { return source_.get_token(); }

 private:
  sigset_t signals_;
  std::stop_source source_;
  std::jthread waiter_;
};

}  // namespace veduta
