// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much memory the preparation of photos may take at once, and how much this machine has.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

namespace veduta {

// Counts bytes and allocates nothing. Who wants more than is left waits, first come, first served,
// so that a large photo is not passed over by small ones for ever. Thread-safe.
class MemoryBudget final {
 public:
  explicit MemoryBudget(uint64_t bytes_max) : bytes_max_(bytes_max) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  // A part of the budget, given back at its end. The budget must outlive it.
  class Share final {
   public:
    Share() = default;
    Share(Share&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Share& operator=(Share&& other) noexcept;
    ~Share() { GiveBack(); }

   private:
    friend class MemoryBudget;
    Share(MemoryBudget* budget, uint64_t bytes) : budget_(budget), bytes_(bytes) {}
    void GiveBack();

    MemoryBudget* budget_ = nullptr;
    uint64_t bytes_ = 0;
  };

  // Waits until so much is left. More than the whole budget is given to one alone, when nothing
  // else is given out. `before_waiting` is called without a lock by whoever has to wait: it may
  // give back shares that are held for convenience only.
  Share Take(uint64_t bytes, const std::function<void()>& before_waiting = {});
  // The same without waiting; none where somebody waits, or where less is left.
  std::optional<Share> TryTake(uint64_t bytes);
  bool HasWaiters() const;
  uint64_t bytes_max() const { return bytes_max_; }

 private:
  const uint64_t bytes_max_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  uint64_t used_ = 0;
  bool Fits(uint64_t bytes) const {
    return used_ == 0 || (bytes <= bytes_max_ && used_ <= bytes_max_ - bytes);
  }

  uint64_t next_ = 0, served_ = 0;  // numbers of those who came, and of those who have their share
};

// Waits for so many bytes, as MemoryBudget::Take does. Empty: nobody counts them.
using TakeMemory = std::function<MemoryBudget::Share(uint64_t bytes)>;

// The memory that this process may use: the smallest of the machine's memory, the limit of its
// control group (Linux, both versions) and the limit of its address space. It asks how much there
// is and never how much is free.
uint64_t UsableMemoryBytes();
// What preparation takes where nobody says how much: half of what the caches leave of `usable`,
// for the other half is the system's, RocksDB's and the map's; at least 256 MiB, which photos of
// 6 Mpx need one at a time. Both are chosen by hand; not measured.
uint64_t DefaultPrepareMemoryBytes(uint64_t usable_bytes, uint64_t cache_bytes);

}  // namespace veduta
