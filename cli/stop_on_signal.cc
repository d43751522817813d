// SPDX-License-Identifier: Apache-2.0
#include "cli/stop_on_signal.h"

#include <unistd.h>

#include <cstdio>
#include <ctime>

namespace veduta {
namespace {

// How long the destructor may have to wait for the thread. Chosen by hand, not measured.
constexpr timespec kPause = {0, 50'000'000};
// What shells report of a process that Ctrl-C ended: 128 + SIGINT.
constexpr int kInterrupted = 130;

}  // namespace

StopOnSignal::StopOnSignal(std::chrono::milliseconds patience) {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  waiter_ = std::jthread([this, patience](std::stop_token done) {
    using Clock = std::chrono::steady_clock;
    auto end = Clock::time_point::max();
    while (!done.stop_requested()) {
      const bool has_come = sigtimedwait(&signals_, nullptr, &kPause) >= 0;
      if (has_come && source_.stop_requested()) _exit(kInterrupted);
      if (has_come) {
        std::fprintf(stderr,
                     "\nveduta: finishing the photo at hand; press Ctrl-C again to stop at once\n");
        if (patience.count() >= 0) end = Clock::now() + patience;
        source_.request_stop();
      }
      if (Clock::now() >= end) {
        std::fprintf(stderr,
                     "veduta: what is at work would take long: it is given up, and done at the "
                     "next start\n");
        _exit(0);
      }
    }
  });
}

StopOnSignal::~StopOnSignal() {
  waiter_.request_stop();
  waiter_.join();
  pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
}

}  // namespace veduta
