// SPDX-License-Identifier: Apache-2.0
#pragma once
// A number of things that all threads together may have: bytes that arrive, connections.

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace veduta {

// Thread-safe.
class Budget final {
 public:
  explicit Budget(uint64_t max) : max_(max) {}
  // False, and nothing is taken, where there is not so much left.
  bool Take(uint64_t count) {
    uint64_t before = used_;
    do {
      if (count > max_ - before) return false;
    } while (!used_.compare_exchange_weak(before, before + count));
    return true;
  }
  void Give(uint64_t count) { used_ -= count; }
  uint64_t used() const { return used_; }

 private:
  const uint64_t max_;
  std::atomic<uint64_t> used_ = 0;
};

// A part of a budget, which is given back when this goes.
struct BudgetShare {
  explicit BudgetShare(std::shared_ptr<Budget> b) : budget(std::move(b)) {}
  BudgetShare(const BudgetShare&) = delete;
  BudgetShare& operator=(const BudgetShare&) = delete;
  ~BudgetShare() { budget->Give(taken); }
  // Makes the share greater; false, and it stays as it is, where there is not so much left.
  bool Grow(uint64_t total) {
    if (!budget->Take(total - taken)) return false;
    taken = total;
    return true;
  }

  const std::shared_ptr<Budget> budget;
  uint64_t taken = 0;
};

}  // namespace veduta
