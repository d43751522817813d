// SPDX-License-Identifier: Apache-2.0
#include "storage/base/thread_pool.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <system_error>

namespace veduta {
namespace {

// The exception of the lowest index: which one is kept does not depend on who comes first.
struct FirstException {
  void Note(size_t i, std::exception_ptr thrown) {
    if (exception && index < i) return;
    index = i;
    exception = std::move(thrown);
  }

  size_t index = 0;
  std::exception_ptr exception;
};

std::exception_ptr RunIndex(const std::function<void(size_t)>& body, size_t i) {
  try {
    body(i);
  } catch (...) {  // ParallelFor throws it again
    return std::current_exception();
  }
  return nullptr;
}

// Shared by the caller and the helpers of one loop; a helper that comes late finds nothing left and
// leaves.
struct Loop {
  explicit Loop(size_t n, const std::function<void(size_t)>& b) : count(n), body(b) {}

  void Run() {
    std::unique_lock lock(mutex);
    while (next < count) {
      const size_t i = next++;
      lock.unlock();
      std::exception_ptr thrown = RunIndex(body, i);
      lock.lock();
      if (thrown) first_exception.Note(i, std::move(thrown));
      if (++done == count) finished.notify_all();
    }
  }

  std::mutex mutex;
  std::condition_variable finished;
  size_t next = 0;
  size_t done = 0;
  FirstException first_exception;
  const size_t count;
  const std::function<void(size_t)> body;
};

void RunTask(const std::function<void()>& task) {
  try {
    task();
  } catch (...) {  // nobody waits for the task who could be told
  }
}

void RunSerially(size_t count, const std::function<void(size_t)>& body) {
  FirstException first;
  for (size_t i = 0; i < count; ++i) {
    if (std::exception_ptr thrown = RunIndex(body, i)) first.Note(i, std::move(thrown));
  }
  if (first.exception) std::rethrow_exception(std::move(first.exception));
}

}  // namespace

ThreadPool::ThreadPool(size_t thread_count) {
  threads_.reserve(thread_count);
  try {
    for (size_t i = 0; i < thread_count; ++i) threads_.emplace_back([this] { Work(); });
  } catch (const std::system_error&) {
    // The machine gives no more threads: those that have begun do the work, or the caller.
  }
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
    RunTask(task);
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
    RunSerially(count, body);
    return;
  }
  const auto loop = std::make_shared<Loop>(count, body);
  AddHelpers(std::min(count - 1, threads_.size()), [loop] { loop->Run(); });
  loop->Run();
  std::unique_lock lock(loop->mutex);
  loop->finished.wait(lock, [&] { return loop->done == loop->count; });
  std::exception_ptr thrown = std::move(loop->first_exception.exception);
  lock.unlock();
  if (thrown) std::rethrow_exception(std::move(thrown));
}

void ThreadPool::AddHelpers(size_t count, const std::function<void()>& help) {
  {
    const std::lock_guard lock(mutex_);
    try {
      for (size_t i = 0; i < count; ++i) tasks_.push_front(help);
    } catch (...) {  // there is no memory for more helpers, and the caller manages without them
    }
  }
  wake_.notify_all();
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
    RunTask(task);
  }
}

}  // namespace veduta
