// SPDX-License-Identifier: Apache-2.0
#pragma once
// The lines of work of a daemon: each kind of it has threads of its own, so that none waits for
// another.

#include <cstdint>
#include <utility>

#include "cli/service/asked_work.h"
#include "cli/service/work_line.h"

namespace veduta {

// Commands (WorkKind) that are at work at the same time. Chosen by hand.
inline constexpr uint32_t kCommandsMax = 2;

struct WorkLinesLimits {
  uint32_t short_threads = 4, long_threads = 2;           // >= 1
  uint32_t waiting_max = 1024, waiting_of_one_max = 256;  // as WorkLimits, of each line
};

// Thread-safe.
class WorkLines final {
 public:
  explicit WorkLines(const WorkLinesLimits& limits);

  // Does the task once a thread for such work has time: WorkLine::Add.
  void Add(WorkKind kind, WorkOwner owner, WorkLine::Task task) {
    LineOf(kind).Add(std::move(owner), std::move(task));
  }
  // WorkLine::Close of all.
  void Close();

 private:
  WorkLine& LineOf(WorkKind kind);

  WorkLine short_, changes_, long_, commands_, removals_;
};

}  // namespace veduta
