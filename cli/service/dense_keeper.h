// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keeps the dense city up to date while the sparse one grows: a thread of its own that runs the
// dense pass whenever photos have changed something.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

struct DenseKeeping {
  bool is_wanted = false;
  DensifyRequest request;  // without callbacks
  // A pass begins when nothing has changed for so long, 1 to 86,400 s; in a city that changes all
  // the time it begins after `patience_s` all the same, from pause_s to 86,400 s. Chosen by hand.
  uint32_t pause_s = 5, patience_s = 60;

  Status Check() const;  // the first violated bound, named with its value
};

// Thread-safe. The engine must outlive it.
class DenseKeeper final {
 public:
  // `failed` hears of each pass that failed, from the keeper's thread; it is tried again after
  // patience_s. Starts nothing where no dense city is wanted.
  DenseKeeper(Engine* engine, const DenseKeeping& options,
              std::function<void(const Status&)> failed);
  // Stops a pass, which ends after the piece at hand, and waits for that.
  ~DenseKeeper();
  DenseKeeper(const DenseKeeper&) = delete;
  DenseKeeper& operator=(const DenseKeeper&) = delete;

  // While it is paused no pass begins, and one that runs ends after the piece at hand: what it has
  // made is kept. kInvalidArgument where no dense city is wanted.
  Status Pause(bool is_paused);

  // No pass runs while it lives: the one that runs has ended, after the piece at hand.
  class Rest final {
   public:
    explicit Rest(DenseKeeper* keeper);
    ~Rest();
    Rest(const Rest&) = delete;
    Rest& operator=(const Rest&) = delete;

   private:
    DenseKeeper* const keeper_;
  };

  // A pass that somebody else makes, which it stands for. A rest ends it, too, after the piece at
  // hand.
  class OthersPass final {
   public:
    // Made when no other pass runs any more, and all rests are over: the keeper's own pass is ended
    // for it, one of somebody else is waited for. Also ended by `stop`, before its turn as well.
    OthersPass(DenseKeeper* keeper, const std::stop_token& stop);
    ~OthersPass();
    OthersPass(const OthersPass&) = delete;
    OthersPass& operator=(const OthersPass&) = delete;

    std::stop_token token() const { return pass_.get_token(); }
    void Tell(std::string_view stage, size_t done, size_t total) {
      keeper_->Tell(stage, done, total);
    }

   private:
    DenseKeeper* const keeper_;
    bool has_begun_ = false;
    std::stop_source pass_;
    std::stop_callback<std::function<void()>> on_stop_;
  };

  // {"state", "stage", "done", "total", "passes", "why_not"}: docs/serving.md.
  Json ToJson() const;

 private:
  using Clock = std::chrono::steady_clock;

  void Run(std::stop_token stop);
  void Tell(std::string_view stage, size_t done, size_t total);
  // Whether anything but the dense pass has written into the journal since it was last read to its
  // end, which it is now.
  Result<bool> HasChanged();
  // Waits until a pass is due; false where it is to stop.
  bool WaitUntilDue(const std::stop_token& stop);
  void Pass(const std::stop_token& stop);

  Engine* const engine_;
  const DenseKeeping options_;
  const std::function<void(const Status&)> failed_;
  uint64_t next_entry_ = 1;  // of the journal; the thread's own

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_paused_ = false, is_at_work_ = false;
  uint32_t rests_ = 0;   // that are asked for
  uint32_t others_ = 0;  // passes of others that run, or wait for their turn
  std::string stage_;
  size_t done_ = 0, total_ = 0;
  uint64_t passes_ = 0;    // that came to their end
  std::string why_not_;    // why the last one failed
  std::stop_source pass_;  // of the one that runs
  std::jthread thread_;
};

}  // namespace veduta
