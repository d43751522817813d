// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/healed_writer.h"

namespace veduta {
namespace {

// A commit is a write to the disk that is waited for. Chosen by hand; not measured.
constexpr size_t kCommitBytes = 8 << 20;

}  // namespace

Status HealedWriter::Put(const std::function<void(Transaction&)>& put) {
  if (target_ == nullptr) return Status::Ok();
  if (!open_) open_ = target_->BeginTransaction();
  put(*open_);
  return open_->size_bytes() < kCommitBytes ? Status::Ok() : Commit();
}

Status HealedWriter::Commit() {
  if (!open_) return Status::Ok();
  const std::unique_ptr<Transaction> done = std::move(open_);
  return done->Commit();
}

}  // namespace veduta
