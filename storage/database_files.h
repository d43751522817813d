// SPDX-License-Identifier: Apache-2.0
#pragma once
// One open RocksDB with its families. Shared by the Database, its snapshots, transactions and
// pinned values: the files are closed, and the lock given up, when the last of them goes.

#include <rocksdb/db.h>

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/database.h"
#include "storage/families.h"

namespace veduta {

class DatabaseFiles final {
 public:
  // As Database::Open says, without the sweep.
  static Result<std::shared_ptr<DatabaseFiles>> Open(const std::string& path,
                                                     const DatabaseOptions& options);
  ~DatabaseFiles();
  DatabaseFiles(const DatabaseFiles&) = delete;
  DatabaseFiles& operator=(const DatabaseFiles&) = delete;

  rocksdb::DB& db() const { return *db_; }
  rocksdb::ColumnFamilyHandle* handle(Family family) const {
    return handles_[static_cast<size_t>(family)];
  }
  rocksdb::FileSystem& file_system() const { return *file_system_; }
  const std::string& path() const { return path_; }
  bool read_only() const { return read_only_; }

  // Applies a batch whole or not at all. Once a write has failed, all later ones are refused with
  // its reason: what the disk holds is known only after the log has been read again.
  Status Write(rocksdb::WriteBatch* batch, bool sync, std::string_view doing);
  // Applies a commit; kBusy when the state record has changed since `state_version` was read.
  Status Commit(rocksdb::WriteBatch* batch, bool changes_state, uint64_t state_version);
  uint64_t state_version() const { return state_version_.load(); }
  // Held while a commit is decided and applied; also by what must not run beside one.
  std::mutex& commit_mutex() { return commit_mutex_; }

 private:
  friend class DatabaseOpener;
  DatabaseFiles() = default;

  // Destruction runs from the bottom up: the handles, the database, then what it stands on.
  std::string path_;
  bool read_only_ = false;
  bool sync_wal_ = true;
  std::shared_ptr<rocksdb::FileSystem> file_system_;
  std::unique_ptr<rocksdb::Env> env_;  // null for the default
  std::unique_ptr<rocksdb::DB> db_;
  std::array<rocksdb::ColumnFamilyHandle*, kFamilyCount> handles_{};
  rocksdb::ColumnFamilyHandle* default_handle_ =
      nullptr;  // RocksDB insists on a family named so; it stays empty

  std::mutex commit_mutex_;
  std::atomic<uint64_t> state_version_{0};
  std::mutex failure_mutex_;
  Status failure_;  // of the first write that failed
};

}  // namespace veduta
