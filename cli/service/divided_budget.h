// SPDX-License-Identifier: Apache-2.0
#pragma once
// A number of things that all threads together may have, of which one who asks leaves some to
// others.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace veduta {

// Who asks has no more than half of it by several shares; one share alone may be all of it. Who has
// no name is not told apart from others like that, and has what there is. Thread-safe.
class DividedBudget final {
 public:
  explicit DividedBudget(uint64_t max) : max_(max) {}

  // Makes a share of `before` as large as `after`; false, and nothing is taken, where there is not
  // so much left, or not for this one.
  bool Grow(const std::string& asker, uint64_t before, uint64_t after) {
    const std::lock_guard lock(mutex_);
    const uint64_t others = used_ - before;
    if (after > max_ - std::min(max_, others)) return false;
    if (!asker.empty()) {
      uint64_t& of_asker = used_by_[asker];
      const uint64_t elsewhere = of_asker - before;
      if (elsewhere > 0 && elsewhere + after > max_ / 2) return false;
      of_asker = elsewhere + after;
    }
    used_ = others + after;
    return true;
  }
  void Give(const std::string& asker, uint64_t count) {
    const std::lock_guard lock(mutex_);
    used_ -= count;
    if (asker.empty() || count == 0) return;
    const auto found = used_by_.find(asker);
    found->second -= count;
    if (found->second == 0) used_by_.erase(found);
  }

  uint64_t used() const {
    const std::lock_guard lock(mutex_);
    return used_;
  }
  bool is_full() const { return used() >= max_; }

 private:
  const uint64_t max_;
  mutable std::mutex mutex_;
  uint64_t used_ = 0;
  std::map<std::string, uint64_t> used_by_;
};

// A part of a divided budget, which is given back when this goes.
class DividedShare final {
 public:
  explicit DividedShare(std::shared_ptr<DividedBudget> budget, std::string asker = "")
      : budget_(std::move(budget)), asker_(std::move(asker)) {}
  DividedShare(const DividedShare&) = delete;
  DividedShare& operator=(const DividedShare&) = delete;
  ~DividedShare() { budget_->Give(asker_, taken_); }

  // As DividedBudget::Grow: the share stays as it is where that is false.
  bool Grow(uint64_t total) {
    if (!budget_->Grow(asker_, taken_, total)) return false;
    taken_ = total;
    return true;
  }
  // Whose share it is; only before there is anything in it.
  void Name(std::string asker) { asker_ = std::move(asker); }
  uint64_t taken() const { return taken_; }

 private:
  const std::shared_ptr<DividedBudget> budget_;
  std::string asker_;
  uint64_t taken_ = 0;
};

}  // namespace veduta
