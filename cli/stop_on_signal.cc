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

StopOnSignal::StopOnSignal() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  waiter_ = std::jthread([this](std::stop_token done) {
    while (!done.stop_requested()) {
      if (sigtimedwait(&signals_, nullptr, &kPause) < 0) continue;
      if (source_.stop_requested()) _exit(kInterrupted);
      std::fprintf(stderr,
                   "\nveduta: finishing the photo at hand; press Ctrl-C again to stop at once\n");
      source_.request_stop();
    }
  });
}

StopOnSignal::~StopOnSignal() {
  waiter_.request_stop();
  waiter_.join();
  pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
}

}  // namespace veduta
