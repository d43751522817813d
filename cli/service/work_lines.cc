// SPDX-License-Identifier: Apache-2.0
#include "cli/service/work_lines.h"

namespace veduta {
namespace {

// Changes wait for each other in the engine, which has one writer: a second thread reads what the
// next one says meanwhile. Chosen by hand.
constexpr uint32_t kChangeThreads = 2;

}  // namespace

WorkLines::WorkLines(const WorkLinesLimits& limits)
    : short_({limits.short_threads, limits.waiting_max, limits.waiting_of_one_max}),
      changes_({kChangeThreads, limits.waiting_max, limits.waiting_of_one_max}),
      long_({limits.long_threads, limits.waiting_max, limits.waiting_of_one_max}),
      commands_({.threads = kCommandsMax}),
      // One goes at a time: the engine refuses a second one.
      removals_({1, limits.waiting_max, limits.waiting_of_one_max}) {}

void WorkLines::Close() {
  for (WorkLine* const line : {&short_, &changes_, &long_, &commands_, &removals_}) line->Close();
}

WorkLine& WorkLines::LineOf(WorkKind kind) {
  switch (kind) {
    case WorkKind::kShort:
      return short_;
    case WorkKind::kChange:
      return changes_;
    case WorkKind::kLong:
      return long_;
    case WorkKind::kCommand:
      return commands_;
    case WorkKind::kRemoval:
      return removals_;
  }
  return short_;
}

}  // namespace veduta
