// SPDX-License-Identifier: Apache-2.0
// Goal: the first signal requests a stop; the second one, or a patience that is over, ends the
//   process; without a StopOnSignal signals do what they always do.
// Method: child processes that send signals to themselves.
#include "cli/stop_on_signal.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>

namespace veduta {
namespace {

// The status that waitpid tells of a process that runs `body`.
int StatusOf(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);  // a test that would wait for ever ends by SIGALRM instead
    _exit(body());
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return status;
}

void WaitForStop(const StopOnSignal& stop) {
  while (!stop.token().stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(StopOnSignal, TheFirstSignalIsARequest) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const int status = StatusOf([signal] {
      const StopOnSignal stop;
      if (stop.token().stop_requested()) return 1;
      kill(getpid(), signal);
      WaitForStop(stop);
      return 7;  // the work at hand went on
    });
    ASSERT_TRUE(WIFEXITED(status)) << signal;
    EXPECT_EQ(WEXITSTATUS(status), 7);
  }
}

TEST(StopOnSignal, TheSecondSignalEndsTheProcess) {
  const int status = StatusOf([] {
    const StopOnSignal stop;
    kill(getpid(), SIGINT);
    WaitForStop(stop);
    kill(getpid(), SIGINT);
    while (true) pause();
    return 0;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
}

TEST(StopOnSignal, WhereTheEndTakesLongTheProcessEndsAllTheSame) {
  const int status = StatusOf([] {
    const StopOnSignal stop(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // no signal, no end
    kill(getpid(), SIGTERM);
    WaitForStop(stop);
    while (true) pause();
    return 1;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(StopOnSignal, WhoEndsInTimeIsLeftAlone) {
  const int status = StatusOf([] {
    {
      const StopOnSignal stop(std::chrono::seconds(30));
      kill(getpid(), SIGTERM);
      WaitForStop(stop);
    }
    return 7;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST(StopOnSignal, WithoutASignalNothingStops) {
  const int status = StatusOf([] {
    const StopOnSignal stop;
    return stop.token().stop_requested() ? 1 : 0;
  });
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(StopOnSignal, AfterItSignalsEndTheProcessAgain) {
  const int status = StatusOf([] {
    { const StopOnSignal stop; }
    kill(getpid(), SIGTERM);
    while (true) pause();
    return 0;
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
}

}  // namespace
}  // namespace veduta
