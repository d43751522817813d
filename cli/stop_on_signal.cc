// SPDX-License-Identifier: Apache-2.0
#include "cli/stop_on_signal.h"

#include <unistd.h>

#include <cstdio>
#include <ctime>

namespace veduta {

StopOnSignal::StopOnSignal() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  waiter_ = std::jthread([this](std::stop_token done) {
    while (!done.stop_requested()) {
      const timespec pause = {0, 50'000'000};
      if (sigtimedwait(&signals_, nullptr, &pause) < 0) continue;
      if (source_.stop_requested()) _exit(130);
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
