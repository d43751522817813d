// SPDX-License-Identifier: Apache-2.0
#include "engine/writer/writer.h"

namespace veduta {

Writer::Turn Writer::Take() {
  std::unique_lock lock(mutex_);
  const uint64_t number = next_number_++;
  turn_ended_.wait(lock, [&] { return served_ == number; });
  return Turn(this);
}

Writer::Turn::~Turn() {
  if (writer_ == nullptr) return;
  // Told under the lock: the thread that is served next may end the writer's life.
  const std::lock_guard lock(writer_->mutex_);
  ++writer_->served_;
  // Each thread that waits holds another number, so all look whether it is theirs.
  writer_->turn_ended_.notify_all();
}

}  // namespace veduta
