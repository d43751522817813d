// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work of which one piece may be done at a time, as long as it takes: the dense pass, a removal.

#include <atomic>
#include <optional>
#include <utility>

namespace veduta {

// Whoever does the work claims it before. No lock is held meanwhile, so the work may call back to
// who asked for it. Thread-safe.
class Claimable final {
 public:
  // The right to do the work, until it is destroyed. The claimable must outlive it.
  class Claim {
   public:
    Claim(Claim&& other) noexcept : claimable_(std::exchange(other.claimable_, nullptr)) {}
    Claim& operator=(Claim&&) = delete;
    ~Claim() {
      if (claimable_ != nullptr) claimable_->is_claimed_ = false;
    }

   private:
    friend class Claimable;
    explicit Claim(Claimable* claimable) : claimable_(claimable) {}
    Claimable* claimable_;  // null: moved from
  };

  Claimable() = default;
  Claimable(const Claimable&) = delete;
  Claimable& operator=(const Claimable&) = delete;

  // Nothing while somebody has the claim, this thread included.
  std::optional<Claim> TryClaim() {
    return is_claimed_.exchange(true) ? std::nullopt : std::optional(Claim(this));
  }

 private:
  std::atomic<bool> is_claimed_ = false;
};

}  // namespace veduta
