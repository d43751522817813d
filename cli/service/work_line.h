// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work that waits for one of a few threads. Those who ask take turns, one task each, so that the
// many requests of one do not hold up the single one of another.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "cli/service/client_presence.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// What becomes of a task.
enum class WorkTurn : uint8_t {
  kCome,        // it is to be done now
  kClientGone,  // its turn has come, and nobody waits for it any more
  kClosed,      // the line is closed
  kFull,        // too many tasks wait
  kFullOfOne,   // too many tasks of the same one wait, or their bytes are too many
};

struct WorkLimits {
  uint32_t threads = 1;                      // >= 1
  uint32_t waiting_max = 1024;               // of all; tasks that are at work do not count
  uint32_t waiting_of_one_max = 256;         // of each one who asks
  uint64_t bytes_of_one_max = 128ull << 20;  // that these hold; a single task may hold more
};

// Whose work it is, and what it holds while it waits.
struct WorkOwner {
  std::string asker;
  uint64_t size_bytes = 0;
  // Where nobody waits for the task when its turn comes, it is skipped; null: it never is.
  std::shared_ptr<const ClientPresence> client = nullptr;
};

// Thread-safe.
class WorkLine final {
 public:
  // Called once, with what becomes of it: by a thread of the line where its turn has come, by the
  // thread that adds it where it gets no place, by the one that closes the line where it waited.
  // It should not throw: nobody hears of that.
  using Task = std::function<void(WorkTurn turn)>;

  explicit WorkLine(const WorkLimits& limits) : limits_(limits), pool_(limits.threads) {}
  // Closes, and waits for the tasks that are at work.
  ~WorkLine() { Close(); }
  WorkLine(const WorkLine&) = delete;
  WorkLine& operator=(const WorkLine&) = delete;

  void Add(WorkOwner owner, Task task);
  // Tasks that wait, and those that come later, are told kClosed. Waits for nothing.
  void Close();

 private:
  struct Waiting {
    WorkOwner owner;
    Task task;
  };
  // What waits of one who asks.
  struct Asker {
    std::deque<Waiting> waiting;
    uint64_t size_bytes = 0;
  };
  // The place of a task that comes now: kCome where it gets one. With the lock held.
  WorkTurn PlaceOf(const WorkOwner& owner) const;
  // The next task in turn; nothing where none waits any more.
  std::optional<Waiting> Take();
  void DoNext();

  const WorkLimits limits_;
  std::mutex mutex_;
  bool is_closed_ = false;
  uint32_t waiting_ = 0;
  std::map<std::string, Asker> askers_;  // those of whom something waits
  std::deque<std::string> turns_;        // the same, whose turn is next first
  ThreadPool pool_;  // one call of DoNext waits there for each task here; destroyed first
};

}  // namespace veduta
