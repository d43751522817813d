// SPDX-License-Identifier: Apache-2.0
#pragma once
// A folder with backups of one database. Files lie in `files/`, each once, named by the SHA-256 of
// its bytes; `backups/NUMBER` says which of them a backup consists of (backup_manifest.h). A file
// is there, whole and synced, before a backup names it, so whatever ends the program at any point
// leaves all older backups as they were.

#include <cstdint>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "storage/backup_manifest.h"
#include "storage/base/status.h"

namespace veduta {

// A damaged or missing part of a folder of backups, for a person: which file, and which backups
// want it.
struct BackupDamage {
  std::vector<std::string> sentences;
};

// Not thread-safe; programs exclude each other by a lock.
class BackupFolder final {
 public:
  enum class Use : uint8_t {
    kLook,   // lists, without any lock
    kRead,   // nobody changes the folder meanwhile
    kChange  // nobody reads it meanwhile, either
  };
  // kNotFound where there is no folder of backups at `path`, kBusy while another program works in
  // it, kIoError. With `create` one is made in a folder that is missing or empty; kInvalidArgument
  // where there is something else.
  static Result<BackupFolder> Open(const std::string& path, Use use, bool create = false);

  // The backups that are whole as far as their manifests tell, ascending; `damage` receives the
  // manifests that cannot be read. Reads no other file.
  Result<std::vector<BackupManifest>> List(BackupDamage* damage) const;

  struct Added {
    BackupManifest backup;
    uint64_t copied_files = 0, copied_bytes = 0;  // that the folder did not have
  };
  // Adds a backup of the files in `source`, which nobody changes meanwhile. Files that the last
  // backup has seen are not read again; others are checked (table_check.h), hashed and copied.
  // `database` is the folder that `source` is a copy of; kInvalidArgument where the backups here
  // are of another one. kCorruption names what is damaged in `source`; kIoError, kCancelled.
  Result<Added> Add(const std::string& source, const std::string& database,
                    const std::stop_token& stop);

  // Deletes all but the newest `keep` backups; how many those were.
  Result<uint32_t> Thin(uint32_t keep);
  // Deletes files that no backup names. Does nothing while a manifest cannot be read: what it names
  // is not known.
  Status DropUnused();

  // Reads all files of these backups. kCancelled, kIoError where a folder cannot be read.
  Result<BackupDamage> Check(const std::vector<BackupManifest>& backups,
                             const std::stop_token& stop) const;
  // Copies a backup's files into the folder `target`, which is empty, checks the hash of each, and
  // syncs all. kCorruption names what is damaged.
  Status CopyOut(const BackupManifest& backup, const std::string& target,
                 const std::stop_token& stop) const;

 private:
  struct Lock;
  BackupFolder(std::string path, std::shared_ptr<Lock> lock);
  std::string FilePath(const ContentHash& hash) const;
  bool HasFile(const BackedUpFile& file) const;
  Status CopyIn(const std::string& from, const BackedUpFile& file,
                const std::stop_token& stop) const;

  std::string path_;
  std::shared_ptr<Lock> lock_;
};

}  // namespace veduta
