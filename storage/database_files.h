// SPDX-License-Identifier: Apache-2.0
#pragma once
// One open RocksDB with its families. The Database, its snapshots and its transactions share it.
//
// It can be closed while they still hold it (Database::Reopen does so): every use begins with a
// FilesLease, which keeps the files open for the time of one read or write and is refused once they
// are being closed. What RocksDB wants back before it closes (snapshots, iterators) is registered
// here, and Close gives it back.

#include <rocksdb/db.h>
#include <rocksdb/listener.h>
#include <rocksdb/wal_filter.h>

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <string>
#include <string_view>

#include "storage/acknowledged.h"
#include "storage/base/status.h"
#include "storage/database_options.h"
#include "storage/database_sizes.h"
#include "storage/records/families.h"

namespace veduta {

class DatabaseFiles final {
 public:
  // Something of RocksDB's that must be given back before the database closes.
  class Dependent {
   public:
    // Called by Close, once, while no lease is held.
    virtual void GiveBack() = 0;

   protected:
    ~Dependent() = default;
  };

  // As Database::Open says, without sweeping and counting.
  static Result<std::shared_ptr<DatabaseFiles>> Open(const std::string& path,
                                                     const DatabaseOptions& options);
  ~DatabaseFiles();
  DatabaseFiles(const DatabaseFiles&) = delete;
  DatabaseFiles& operator=(const DatabaseFiles&) = delete;

  // The following two are for the holder of a lease, and for whoever opens the files.
  rocksdb::DB& db() const { return *db_; }
  rocksdb::ColumnFamilyHandle* handle(Family family) const {
    return handles_[static_cast<size_t>(family)];
  }
  rocksdb::FileSystem& file_system() const { return *file_system_; }
  const std::shared_ptr<rocksdb::FileSystem>& shared_file_system() const { return file_system_; }
  const std::string& path() const { return path_; }
  bool read_only() const { return read_only_; }

  // Applies a batch whole or not at all. Once a write has failed, all later ones are refused with
  // its reason: what the disk holds is known only after the log has been read again.
  Status Write(rocksdb::WriteBatch* batch, bool sync, std::string_view doing);
  // Applies a commit; kBusy when the state record has changed since `state_version` was read.
  // `finish` is called before that, with the commit mutex held: it may add to the batch, and its
  // failure is returned with nothing applied.
  Status Commit(rocksdb::WriteBatch* batch, bool changes_state, uint64_t state_version,
                const std::function<Status()>& finish);
  uint64_t state_version() const { return state_version_.load(); }
  // Held while a commit is decided and applied; also by what must not run beside one.
  std::mutex& commit_mutex() { return commit_mutex_; }

  // Closes RocksDB and gives up its lock. Refuses new leases with `reason` from the start, waits
  // for those that are held, and calls GiveBack on all dependents. A second call changes nothing.
  void Close(const Status& reason);
  // Why leases are refused, from now on. For files that are closed.
  void Explain(const Status& reason);

  // A dependent registers itself while it holds a lease. Unregister calls its GiveBack unless Close
  // has done so.
  void Register(Dependent* dependent) const;
  void Unregister(Dependent* dependent) const;

 private:
  friend class DatabaseOpener;
  friend class FilesLease;
  DatabaseFiles() = default;

  // Whether RocksDB has told of an error of its own work: a flush, a compaction, a sync of the log.
  class FailureListener final : public rocksdb::EventListener {
   public:
    void OnBackgroundError(rocksdb::BackgroundErrorReason, rocksdb::Status*) override {
      has_heard_ = true;
    }
    bool has_heard() const { return has_heard_; }

   private:
    std::atomic<bool> has_heard_{false};
  };

  // Where the log stood before a write that is to be acknowledged.
  struct LogPosition {
    uint64_t sequence = 0, log = 0;
  };
  // Opens the file ACKNOWLEDGED: all that the database holds now is durable, because RocksDB has
  // just made tables of its log.
  Status BeginAcknowledging();
  Result<LogPosition> Position() const;
  Result<ManifestPosition> DurableManifest() const;
  Status CheckNoFailure();
  void EndAcknowledging();  // at a clean close

  // Destruction runs from the bottom up: the handles, the database, then what it stands on.
  std::string path_;
  bool read_only_ = false;
  bool sync_wal_ = true;
  std::shared_ptr<rocksdb::FileSystem> file_system_;
  std::unique_ptr<rocksdb::Env> env_;                 // null for the default
  std::unique_ptr<rocksdb::WalFilter> replay_limit_;  // null where all of the log is replayed
  const std::shared_ptr<FailureListener> failures_ = std::make_shared<FailureListener>();
  std::unique_ptr<rocksdb::DB> db_;
  std::unique_ptr<AcknowledgedFile> acknowledged_;  // null where only reading
  std::array<rocksdb::ColumnFamilyHandle*, kFamilyCount> handles_{};
  rocksdb::ColumnFamilyHandle* default_handle_ =
      nullptr;  // RocksDB insists on a family named so; it stays empty

  mutable std::shared_mutex use_mutex_;  // shared by leases, exclusive for Close
  std::atomic<bool> closing_{false};
  mutable std::mutex dependents_mutex_;
  mutable std::set<Dependent*> dependents_;
  Status closed_reason_;  // guarded by dependents_mutex_

  std::mutex commit_mutex_;
  std::atomic<uint64_t> state_version_{0};
  std::mutex failure_mutex_;
  Status failure_;  // of the first write that failed
};

// Keeps the files open while one read or write runs. Held for a bounded time, and never while a
// caller's code runs, because Close waits for it. A thread holds at most one.
class FilesLease final {
 public:
  explicit FilesLease(const DatabaseFiles& files);
  FilesLease(const FilesLease&) = delete;
  FilesLease& operator=(const FilesLease&) = delete;

  // Why the files cannot be used. Not to be used then.
  const Status& status() const { return status_; }

 private:
  std::shared_lock<std::shared_mutex> lock_;
  Status status_;
};

}  // namespace veduta
