// SPDX-License-Identifier: Apache-2.0
// Goal: whoever always has more to do keeps nobody from their turn.
// Method: an event that arms itself again and again, beside a timer.
#include "cli/service/event_loop.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace veduta {
namespace {

constexpr uint64_t kEventsMax = 50'000'000;

kj::Promise<void> ForEver(const bool& is_over, uint64_t* events) {
  return kj::evalLater([&is_over, events]() -> kj::Promise<void> {
    if (is_over || ++*events == kEventsMax) return kj::READY_NOW;
    return ForEver(is_over, events);
  });
}

TEST(EventLoop, LooksForOthersWhileThereIsAlwaysMoreToDo) {
  kj::AsyncIoContext io = MakeEventLoop();
  bool is_over = false;
  uint64_t events = 0;
  const auto busy = ForEver(is_over, &events).eagerlyEvaluate(nullptr);
  io.provider->getTimer().afterDelay(1 * kj::MILLISECONDS).wait(io.waitScope);
  is_over = true;
  EXPECT_LT(events, kEventsMax);
}

}  // namespace
}  // namespace veduta
