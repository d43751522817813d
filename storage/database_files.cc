// SPDX-License-Identifier: Apache-2.0
#include "storage/database_files.h"

#include <rocksdb/write_batch.h>

#include "storage/rocksdb_status.h"

namespace veduta {

DatabaseFiles::~DatabaseFiles() {
  if (!db_) return;
  for (rocksdb::ColumnFamilyHandle* handle : handles_) {
    if (handle != nullptr) db_->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
  }
  if (default_handle_ != nullptr)
    db_->DestroyColumnFamilyHandle(default_handle_).PermitUncheckedError();
  // Nothing can be lost here: what was acknowledged is in the log, whatever Close says.
  db_->Close().PermitUncheckedError();
}

Status DatabaseFiles::Write(rocksdb::WriteBatch* batch, bool sync, std::string_view doing) {
  if (read_only_)
    return Status::InvalidArgument("cannot " + std::string(doing) + ": opened for reading only");
  {
    const std::lock_guard lock(failure_mutex_);
    if (!failure_.ok()) {
      return Status(failure_.code(),
                    "an earlier write failed; open the database again: " + failure_.message());
    }
  }
  rocksdb::WriteOptions options;
  options.sync = sync;
  const Status status = FromRocksdb(db_->Write(options, batch), doing);
  if (!status.ok()) {
    const std::lock_guard lock(failure_mutex_);
    if (failure_.ok()) failure_ = status;
  }
  return status;
}

// Earlier unsynced writes (the write-aheads) become durable with a synced commit: all families
// share one log, which is synced up to and with the commit; and where a memtable switch has begun a
// new log in between, RocksDB's synced write syncs every log that is not synced yet, oldest first,
// and the directory, before it returns (DBImpl::WriteToWAL walks logs_; a flush syncs the closed
// logs before it installs its files, too). tests/storage/durability_test.cc cuts the power there.
Status DatabaseFiles::Commit(rocksdb::WriteBatch* batch, bool changes_state,
                             uint64_t state_version) {
  const std::lock_guard lock(commit_mutex_);
  if (state_version_.load() != state_version) {
    return Status::Busy(
        "another transaction has changed the state since this one began: begin again");
  }
  VEDUTA_RETURN_IF_ERROR(Write(batch, sync_wal_, "commit the transaction"));
  if (changes_state) ++state_version_;
  return Status::Ok();
}

}  // namespace veduta
