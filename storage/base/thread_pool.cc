// SPDX-License-Identifier: Apache-2.0
#include "storage/base/thread_pool.h"

#include <algorithm>
#include <memory>

namespace veduta {
namespace {

// Shared by the caller and the helpers of one loop; a helper that comes late finds nothing left and
// leaves.
struct Loop {
  explicit Loop(size_t n, const std::function<void(size_t)>& b) : count(n), body(b) {}

  void Run() {
    std::unique_lock lock(mutex);
    while (next < count) {
      const size_t i = next++;
      lock.unlock();
      body(i);
      lock.lock();
      if (++done == count) finished.notify_all();
    }
  }

  std::mutex mutex;
  std::condition_variable finished;
  size_t next = 0;
  size_t done = 0;
  const size_t count;
  const std::function<void(size_t)> body;
};

}  // namespace

ThreadPool::ThreadPool(size_t thread_count) {
  threads_.reserve(thread_count);
  for (size_t i = 0; i < thread_count; ++i) threads_.emplace_back([this] { Work(); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::Submit(std::function<void()> task) {
  if (threads_.empty()) {
    task();
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

void ThreadPool::ParallelFor(size_t count, const std::function<void(size_t)>& body) {
  if (count == 0) return;
  if (count == 1 || threads_.empty()) {
    for (size_t i = 0; i < count; ++i) body(i);
    return;
  }
  const auto loop = std::make_shared<Loop>(count, body);
  const size_t helper_count = std::min(count - 1, threads_.size());
  {
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < helper_count; ++i) tasks_.push_front([loop] { loop->Run(); });
  }
  wake_.notify_all();
  loop->Run();
  std::unique_lock lock(loop->mutex);
  loop->finished.wait(lock, [&] { return loop->done == loop->count; });
}

void ThreadPool::Work() {
  for (;;) {
    std::function<void()> task;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

}  // namespace veduta
