// SPDX-License-Identifier: Apache-2.0
#pragma once
// A view of the database that stays whole while another process writes to it.
//
// The writer deletes table files and blob files that its own newest state no longer needs. A file
// that a process has open stays readable until it is closed, also after it was deleted. RocksDB
// keeps all tables open when it opens the database with max_open_files = -1, but opens a blob file
// only when it first reads from it. HeldFiles opens them at once, and gives RocksDB those.
//
// So a reader needs one open file for each table and each blob file, of which most databases have
// one for 64 to 256 MB: about 8,000 for 1 TB. Nothing is written, and nothing is left behind.

#include <rocksdb/db.h>
#include <rocksdb/file_system.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "storage/base/status.h"

namespace veduta {

class HeldFiles final : public rocksdb::FileSystemWrapper {
 public:
  explicit HeldFiles(const std::shared_ptr<rocksdb::FileSystem>& target)
      : FileSystemWrapper(target) {}
  const char* Name() const override { return "veduta.HeldFiles"; }

  // Opens all blob files of the family, as `db` knows them; `db` stands on this. kNotFound where
  // one has been deleted meanwhile: then the database is to be opened again.
  Status HoldBlobFiles(rocksdb::DB& db, rocksdb::ColumnFamilyHandle* family);

  rocksdb::IOStatus NewRandomAccessFile(const std::string& name,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
                                        rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus GetFileSize(const std::string& name, const rocksdb::IOOptions& options,
                                uint64_t* size_bytes, rocksdb::IODebugContext* debug) override;

 private:
  struct Held {
    std::shared_ptr<rocksdb::FSRandomAccessFile> file;
    uint64_t size_bytes = 0;
  };
  const Held* Find(const std::string& path) const;

  mutable std::mutex mutex_;
  std::map<std::string, Held> held_;  // by their names in the folder; never removed
};

}  // namespace veduta
