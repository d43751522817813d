// SPDX-License-Identifier: Apache-2.0
#pragma once
// A bounded cache that gives up the least recently used entry first.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "storage/base/status.h"

namespace veduta {

// Values are cheap to copy and own what they hold: std::shared_ptr<const T>, as a rule. Every value
// has a cost, in a unit of the owner's choice (bytes, or 1 for each entry); the costs of what is
// kept sum up to at most `cost_max`, except that the newest entry always stays. Thread-safe.
template <typename Key, typename Value, typename Hash = std::hash<Key>>
class LruCache final {
 public:
  explicit LruCache(uint64_t cost_max) : cost_max_(cost_max) {}

  // A value-initialised Value where the key is not kept. O(1).
  Value Find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = where_.find(key);
    if (found == where_.end()) return Value();
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  // Keeps the value, unless the key is kept already: the first one stays. O(1) amortised.
  void Put(const Key& key, Value value, uint64_t cost) {
    const std::lock_guard lock(mutex_);
    if (where_.contains(key)) return;
    entries_.push_front({key, std::move(value), cost});
    where_[key] = entries_.begin();
    cost_ += cost;
    while (cost_ > cost_max_ && entries_.size() > 1) {
      cost_ -= entries_.back().cost;
      where_.erase(entries_.back().key);
      entries_.pop_back();
    }
  }

  // The kept value, or the one that `make` returns a Result of, which is kept then. Two threads
  // that miss at once both make one, and the first that is done is kept. `make` runs without a
  // lock; its error is returned and nothing is kept. `cost_of` tells a value's cost.
  template <typename Make, typename CostOf>
  Result<Value> GetOrMake(const Key& key, const Make& make, const CostOf& cost_of) {
    if (Value kept = Find(key)) return kept;
    VEDUTA_ASSIGN_OR_RETURN(Value made, make());
    Put(key, made, cost_of(made));
    return made;
  }

  // Forgets one entry, or all.
  void Erase(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = where_.find(key);
    if (found == where_.end()) return;
    cost_ -= found->second->cost;
    entries_.erase(found->second);
    where_.erase(found);
  }
  void Clear() {
    const std::lock_guard lock(mutex_);
    entries_.clear();
    where_.clear();
    cost_ = 0;
  }

  uint64_t cost() const {
    const std::lock_guard lock(mutex_);
    return cost_;
  }
  size_t size() const {
    const std::lock_guard lock(mutex_);
    return entries_.size();
  }

 private:
  struct Entry {
    Key key;
    Value value;
    uint64_t cost;
  };
  using Entries = std::list<Entry>;

  const uint64_t cost_max_;
  mutable std::mutex mutex_;
  Entries entries_;  // the most recently used first
  std::unordered_map<Key, typename Entries::iterator, Hash> where_;
  uint64_t cost_ = 0;
};

}  // namespace veduta
