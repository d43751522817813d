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
  // Starts `thread_count` threads (0 is allowed).
  explicit ThreadPool(size_t thread_count);
  // Finishes every submitted task, then joins.
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  size_t thread_count() const { return threads_.size(); }

  // Queues a task behind the others; runs it at once when the pool has no threads.
  void Submit(std::function<void()> task);

  // Calls body(0..count-1), each once, in any order, on the caller and on idle threads of the pool;
  // returns when all are done. Its pieces go before queued tasks. Thread-safe; bodies must not
  // throw.
  void ParallelFor(size_t count, const std::function<void(size_t)>& body);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace veduta
