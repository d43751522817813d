// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a new database in pieces, or nothing at all where a repair is only looked at.

#include <functional>
#include <memory>

#include "storage/database.h"

namespace veduta {

// Not thread-safe.
class HealedWriter final {
 public:
  // A null target: nothing is written, and every function is Ok. The target has to outlive it.
  explicit HealedWriter(Database* target) : target_(target) {}

  // Null where nothing is written.
  Database* target() const { return target_; }
  // Calls put(transaction) unless nothing is written, and commits when enough has been collected.
  Status Put(const std::function<void(Transaction&)>& put);
  // To be called after the last Put.
  Status Commit();

 private:
  Database* const target_;
  std::unique_ptr<Transaction> open_;
};

}  // namespace veduta
