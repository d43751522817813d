// SPDX-License-Identifier: Apache-2.0
// Goal: work of one kind waits for none of another kind, and all that waits hears of the end.
// Method: each kind in turn fills its threads with tasks that are held.
#include "cli/service/work_lines.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

namespace veduta {
namespace {

constexpr WorkKind kKinds[] = {WorkKind::kShort, WorkKind::kChange, WorkKind::kLong,
                               WorkKind::kCommand, WorkKind::kRemoval};

TEST(WorkLines, NoKindWaitsForAnother) {
  for (const WorkKind held : kKinds) {
    std::promise<void> let_go;
    const std::shared_future<void> go = let_go.get_future().share();
    std::atomic<int> ended = 0, closed = 0;
    constexpr int kCount = 20;  // more than there are threads of any kind
    {
      WorkLines lines({});
      for (int i = 0; i < kCount; ++i) {
        lines.Add(held, {"anna"}, [&, go](WorkTurn turn) {
          if (turn == WorkTurn::kCome) go.wait();
          ++(turn == WorkTurn::kCome ? ended : closed);
        });
      }
      for (const WorkKind other : kKinds) {
        if (other == held) continue;
        std::promise<WorkTurn> told;
        lines.Add(other, {"bela"}, [&](WorkTurn turn) { told.set_value(turn); });
        EXPECT_EQ(told.get_future().get(), WorkTurn::kCome)
            << static_cast<int>(other) << " beside " << static_cast<int>(held);
      }
      lines.Close();
      let_go.set_value();
    }
    EXPECT_GT(closed, 0);
    EXPECT_EQ(ended + closed, kCount);
  }
}

}  // namespace
}  // namespace veduta
