// SPDX-License-Identifier: Apache-2.0
#pragma once
// A fixed set of threads. The caller of ParallelFor works too, so a pool of no threads is valid and
// serial.

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace veduta {

class ThreadPool final {
 public:
  // Starts `thread_count` threads (0 is allowed), or as many as the machine gives.
  explicit ThreadPool(size_t thread_count);
  // Finishes every submitted task, then joins.
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  size_t thread_count() const { return threads_.size(); }

  // Queues a task behind the others; runs it at once when the pool has no threads. What the task
  // throws is dropped, since nobody waits for it: a task that somebody waits for must catch what it
  // throws, and tell of it. Thread-safe. Throws std::bad_alloc where the task cannot be queued.
  void Submit(std::function<void()> task);

  // Calls body(0..count-1), each once, in any order, on the caller and on idle threads of the pool;
  // returns when all are done. Its pieces go before queued tasks. Where calls throw, all others are
  // made all the same, and then the caller receives the exception of the lowest index, whatever the
  // number of threads. Thread-safe.
  void ParallelFor(size_t count, const std::function<void(size_t)>& body);

 private:
  // Queues up to `count` runs of `help` before the other tasks: fewer where memory is short.
  void AddHelpers(size_t count, const std::function<void()>& help);
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace veduta
