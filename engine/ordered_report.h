// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reports what many threads have done in the order in which it was asked for.

#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <utility>

namespace veduta {

// One call of `report` at a time, from the thread whose answer made it possible and without a lock
// held: it may take its time, and use what others wait for. Thread-safe.
template <typename Answer>
class OrderedReport final {
 public:
  // `report` must outlive it.
  explicit OrderedReport(const std::function<void(const Answer&)>& report) : report_(report) {}

  // The answer of this index, each once. What another thread is reporting at this moment goes on
  // with it; so not all is reported until every call of Done has returned.
  void Done(size_t index, Answer answer) {
    std::unique_lock lock(mutex_);
    waiting_.emplace(index, std::move(answer));
    if (is_reporting_) return;
    is_reporting_ = true;
    for (auto next = waiting_.extract(next_); !next.empty(); next = waiting_.extract(next_)) {
      ++next_;
      lock.unlock();
      try {
        report_(next.mapped());
      } catch (...) {  // the next answer is reported all the same
        lock.lock();
        is_reporting_ = false;
        throw;
      }
      lock.lock();
    }
    is_reporting_ = false;
  }

 private:
  const std::function<void(const Answer&)>& report_;
  std::mutex mutex_;  // of what follows
  bool is_reporting_ = false;
  size_t next_ = 0;  // of the next report
  std::map<size_t, Answer> waiting_;
};

}  // namespace veduta
