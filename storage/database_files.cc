// SPDX-License-Identifier: Apache-2.0
#include "storage/database_files.h"

#include <rocksdb/convenience.h>
#include <rocksdb/transaction_log.h>
#include <rocksdb/write_batch.h>

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "storage/log_names.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// Each one fails only where a log was filled, flushed and deleted within microseconds. Chosen by
// hand; not measured.
constexpr int kAttemptsToSeeLog = 10;

// Whoever closes the database leaves at most so much in memtables, for every later opening replays
// the log that they are made of, also one that only reads. Chosen by hand.
constexpr uint64_t kReplayedBytesMax = 8u << 20;

// Writes the memtables into tables, where they are large. Whether it helped is of no account: what
// was acknowledged is in the log.
void ShortenLog(rocksdb::DB& db, std::span<rocksdb::ColumnFamilyHandle* const> handles) {
  uint64_t bytes = 0;
  if (!db.GetAggregatedIntProperty(rocksdb::DB::Properties::kCurSizeAllMemTables, &bytes) ||
      bytes <= kReplayedBytesMax)
    return;
  std::vector<rocksdb::ColumnFamilyHandle*> families;
  for (rocksdb::ColumnFamilyHandle* const handle : handles)
    if (handle != nullptr) families.push_back(handle);
  db.Flush(rocksdb::FlushOptions(), families).PermitUncheckedError();
}

}  // namespace

DatabaseFiles::~DatabaseFiles() {
  Close(Status::IoError("the database is closed"));
}

void DatabaseFiles::Close(const Status& reason) {
  {
    const std::lock_guard lock(dependents_mutex_);
    if (closed_reason_.ok()) closed_reason_ = reason;
  }
  closing_.store(true);
  const std::lock_guard alone(use_mutex_);
  if (!db_) return;
  {
    const std::lock_guard lock(dependents_mutex_);
    for (Dependent* dependent : dependents_) dependent->GiveBack();
    dependents_.clear();
  }
  if (!read_only_ && !failures_->has_heard() && CheckNoFailure().ok()) ShortenLog(*db_, handles_);
  for (rocksdb::ColumnFamilyHandle*& handle : handles_) {
    if (handle != nullptr) db_->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
    handle = nullptr;
  }
  if (default_handle_ != nullptr)
    db_->DestroyColumnFamilyHandle(default_handle_).PermitUncheckedError();
  default_handle_ = nullptr;
  EndAcknowledging();
  // Nothing can be lost here: what was acknowledged is in the log, whatever Close says.
  db_->Close().PermitUncheckedError();
  db_.reset();
}

void DatabaseFiles::Explain(const Status& reason) {
  const std::lock_guard lock(dependents_mutex_);
  closed_reason_ = reason;
}

void DatabaseFiles::Register(Dependent* dependent) const {
  const std::lock_guard lock(dependents_mutex_);
  dependents_.insert(dependent);
}

void DatabaseFiles::Unregister(Dependent* dependent) const {
  // Close holds the same mutex while it calls GiveBack, and RocksDB is open until it lets go of it.
  const std::lock_guard lock(dependents_mutex_);
  if (dependents_.erase(dependent) > 0) dependent->GiveBack();
}

FilesLease::FilesLease(const DatabaseFiles& files) {
  // Whoever sees that the files are being closed does not ask for the lock: Close gets it as soon
  // as the leases that are held end, however many readers there are.
  if (!files.closing_.load()) {
    lock_ = std::shared_lock(files.use_mutex_);
    if (!files.closing_.load()) return;
    lock_.unlock();
  }
  const std::lock_guard lock(files.dependents_mutex_);
  status_ = files.closed_reason_;
}

Status DatabaseFiles::Write(rocksdb::WriteBatch* batch, bool sync, std::string_view doing) {
  if (read_only_)
    return Status::InvalidArgument("cannot " + std::string(doing) + ": opened for reading only");
  const FilesLease lease(*this);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  VEDUTA_RETURN_IF_ERROR(CheckNoFailure());
  rocksdb::WriteOptions options;
  options.sync = sync;
  const bool acknowledges = sync && acknowledged_ != nullptr;
  LogPosition before;
  if (acknowledges) {
    VEDUTA_ASSIGN_OR_RETURN(before, Position());
  }
  const Status status = FromRocksdb(db_->Write(options, batch), doing);
  if (!status.ok()) {
    const std::lock_guard lock(failure_mutex_);
    if (failure_.ok()) failure_ = status;
    return status;
  }
  // Others may have written in between: the batch ends here, or later.
  if (acknowledges) acknowledged_->Advance(before.sequence + batch->Count(), before.log);
  return Status::Ok();
}

Status DatabaseFiles::CheckNoFailure() {
  const std::lock_guard lock(failure_mutex_);
  if (failure_.ok()) return Status::Ok();
  return Status(failure_.code(),
                "an earlier write failed; open the database again: " + failure_.message());
}

// A log that is begun after this only makes the position older than it need be. RocksDB looks up
// the number of its log and then the file's size, and may delete the log in between.
Result<DatabaseFiles::LogPosition> DatabaseFiles::Position() const {
  std::unique_ptr<rocksdb::LogFile> log;
  rocksdb::Status found;
  for (int attempt = 0; attempt < kAttemptsToSeeLog; ++attempt) {
    found = db_->GetCurrentWalFile(&log);
    if (!found.IsNotFound() && !found.IsPathNotFound()) break;
  }
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(found, "look at the log of the database at " + path_));
  return LogPosition{db_->GetLatestSequenceNumber(), log->LogNumber()};
}

Status DatabaseFiles::BeginAcknowledging() {
  VEDUTA_ASSIGN_OR_RETURN(const LogPosition now, Position());
  VEDUTA_ASSIGN_OR_RETURN(const ManifestPosition manifest, DurableManifest());
  VEDUTA_ASSIGN_OR_RETURN(
      acknowledged_,
      AcknowledgedFile::Open(file_system_, path_, {now.sequence, 0, now.log, manifest}));
  return Status::Ok();
}

// RocksDB syncs each change of its manifest before it goes on.
Result<ManifestPosition> DatabaseFiles::DurableManifest() const {
  std::vector<std::string> names;
  ManifestPosition manifest;
  const std::string doing = "look at the manifest of the database at " + path_;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(db_->GetLiveFiles(names, &manifest.size_bytes, /*flush_memtable=*/false), doing));
  for (const std::string& name : names) {
    const std::optional<uint64_t> number =
        ParseManifestName(std::string_view(name).substr(1 /* a slash */));
    if (number) manifest.number = *number;
  }
  return manifest;
}

// A log that could not be written or synced must not be synced again: Debian's RocksDB is built
// with its assertions, and one of them ends the process then. A flush that still runs could fail
// while this decides, so it is waited for.
void DatabaseFiles::EndAcknowledging() {
  if (acknowledged_ == nullptr) return;
  rocksdb::CancelAllBackgroundWork(db_.get(), /*wait=*/true);
  if (failures_->has_heard() || !CheckNoFailure().ok()) return;
  const uint64_t sequence = db_->GetLatestSequenceNumber();
  const Result<ManifestPosition> manifest = DurableManifest();
  if (manifest.ok()) acknowledged_->Finish(db_->SyncWAL().ok() ? sequence : 0, *manifest);
}

// Earlier unsynced writes (the write-aheads) become durable with a synced commit: all families
// share one log, which is synced up to and with the commit; and where a memtable switch has begun a
// new log in between, RocksDB's synced write syncs every log that is not synced yet, oldest first,
// and the directory, before it returns (DBImpl::WriteToWAL walks logs_; a flush syncs the closed
// logs before it installs its files, too). tests/storage/durability_test.cc cuts the power there.
Status DatabaseFiles::Commit(rocksdb::WriteBatch* batch, bool changes_state, uint64_t state_version,
                             const std::function<Status()>& finish) {
  const std::lock_guard lock(commit_mutex_);
  if (state_version_.load() != state_version) {
    return Status::Busy(
        "another transaction has changed the state since this one began: begin again");
  }
  VEDUTA_RETURN_IF_ERROR(finish());
  VEDUTA_RETURN_IF_ERROR(Write(batch, sync_wal_, "commit the transaction"));
  if (changes_state) ++state_version_;
  return Status::Ok();
}

}  // namespace veduta
