// SPDX-License-Identifier: Apache-2.0
#include "cli/service/work_line.h"

#include <utility>

namespace veduta {

WorkTurn WorkLine::PlaceOf(const WorkOwner& owner) const {
  if (is_closed_) return WorkTurn::kClosed;
  if (waiting_ >= limits_.waiting_max) return WorkTurn::kFull;
  const auto found = askers_.find(owner.asker);
  if (found == askers_.end()) return WorkTurn::kCome;
  const Asker& asker = found->second;
  const bool fits = asker.waiting.size() < limits_.waiting_of_one_max &&
                    owner.size_bytes <= limits_.bytes_of_one_max &&
                    asker.size_bytes <= limits_.bytes_of_one_max - owner.size_bytes;
  return fits || asker.waiting.empty() ? WorkTurn::kCome : WorkTurn::kFullOfOne;
}

void WorkLine::Add(WorkOwner owner, Task task) {
  WorkTurn place = WorkTurn::kCome;
  {
    const std::lock_guard lock(mutex_);
    place = PlaceOf(owner);
    if (place == WorkTurn::kCome) {
      pool_.Submit([this] { DoNext(); });  // before the task is here: it may lack the memory
      const auto [found, is_new] = askers_.try_emplace(owner.asker);
      if (is_new) turns_.push_back(owner.asker);
      found->second.size_bytes += owner.size_bytes;
      found->second.waiting.push_back({std::move(owner), std::move(task)});
      ++waiting_;
    }
  }
  if (place != WorkTurn::kCome) task(place);
}

std::optional<WorkLine::Waiting> WorkLine::Take() {
  const std::lock_guard lock(mutex_);
  if (turns_.empty()) return std::nullopt;
  std::string name = std::move(turns_.front());
  turns_.pop_front();
  const auto found = askers_.find(name);
  Asker& asker = found->second;
  std::optional<Waiting> taken = std::move(asker.waiting.front());
  asker.waiting.pop_front();
  asker.size_bytes -= taken->owner.size_bytes;
  --waiting_;
  if (asker.waiting.empty()) {
    askers_.erase(found);
  } else {
    turns_.push_back(std::move(name));
  }
  return taken;
}

void WorkLine::DoNext() {
  const std::optional<Waiting> next = Take();
  if (!next) return;
  const bool is_gone = next->owner.client != nullptr && next->owner.client->has_left();
  next->task(is_gone ? WorkTurn::kClientGone : WorkTurn::kCome);
}

void WorkLine::Close() {
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  while (const std::optional<Waiting> next = Take()) next->task(WorkTurn::kClosed);
}

}  // namespace veduta
