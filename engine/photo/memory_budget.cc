// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/memory_budget.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace veduta {
namespace {

constexpr uint64_t kDefaultBytesMin = 256ull << 20;  // see DefaultPrepareMemoryBytes

// The number in a file of a control group; none where there is no file, or where it says "max".
std::optional<uint64_t> ReadLimit(const std::string& path) {
  std::ifstream file(path);
  uint64_t limit = 0;
  if (file >> limit) return limit;
  return std::nullopt;
}

// The smallest limit of the process's control groups, which lie within each other.
uint64_t ControlGroupLimit() {
  uint64_t limit = std::numeric_limits<uint64_t>::max();
  const auto lower = [&](const std::string& path) {
    if (const auto read = ReadLimit(path)) limit = std::min(limit, *read);
  };
  lower("/sys/fs/cgroup/memory/memory.limit_in_bytes");
  lower("/sys/fs/cgroup/memory.max");
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const size_t path_at = line.find(":/");
    if (path_at == std::string::npos) continue;
    const bool is_memory_v1 = line.find(":memory:") != std::string::npos;
    if (!line.starts_with("0::") && !is_memory_v1) continue;
    const std::string root = is_memory_v1 ? "/sys/fs/cgroup/memory" : "/sys/fs/cgroup";
    const char* const name = is_memory_v1 ? "/memory.limit_in_bytes" : "/memory.max";
    for (std::string path = line.substr(path_at + 1); path.size() > 1; path.resize(path.rfind('/')))
      lower(root + path + name);
  }
  return limit;
}

}  // namespace

MemoryBudget::Share& MemoryBudget::Share::operator=(Share&& other) noexcept {
  if (this != &other) {
    GiveBack();
    budget_ = std::exchange(other.budget_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
  }
  return *this;
}

void MemoryBudget::Share::GiveBack() {
  if (budget_ == nullptr) return;
  {
    const std::lock_guard lock(budget_->mutex_);
    budget_->used_ -= bytes_;
  }
  budget_->changed_.notify_all();
  budget_ = nullptr;
}

std::optional<MemoryBudget::Share> MemoryBudget::TryTake(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (next_ != served_ || !Fits(bytes)) return std::nullopt;
  used_ += bytes;
  return Share(this, bytes);
}

MemoryBudget::Share MemoryBudget::Take(uint64_t bytes,
                                       const std::function<void()>& before_waiting) {
  std::unique_lock lock(mutex_);
  const uint64_t number = next_++;
  const auto may_go = [&] { return number == served_ && Fits(bytes); };
  if (!may_go() && before_waiting) {
    lock.unlock();
    before_waiting();
    lock.lock();
  }
  changed_.wait(lock, may_go);
  ++served_;
  used_ += bytes;
  lock.unlock();
  changed_.notify_all();
  return Share(this, bytes);
}

bool MemoryBudget::HasWaiters() const {
  const std::lock_guard lock(mutex_);
  return next_ != served_;
}

uint64_t UsableMemoryBytes() {
  uint64_t usable = ControlGroupLimit();
  const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page_bytes > 0)
    usable = std::min(usable, static_cast<uint64_t>(pages) * static_cast<uint64_t>(page_bytes));
  rlimit address_space{};
  if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
    usable = std::min<uint64_t>(usable, address_space.rlim_cur);
  return usable;
}

uint64_t DefaultPrepareMemoryBytes(uint64_t usable_bytes, uint64_t cache_bytes) {
  const uint64_t left = usable_bytes > cache_bytes ? usable_bytes - cache_bytes : 0;
  return std::max(left / 2, kDefaultBytesMin);
}

}  // namespace veduta
