// SPDX-License-Identifier: Apache-2.0
#pragma once
// The steps of opening or creating a database's folder.
//
// A folder is ours when it holds the file VEDUTA, which creation writes first; the database is
// complete once meta/format is there, which creation writes last. A creation that was cut short is
// finished by creating again.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/database_files.h"
#include "storage/held_files.h"
#include "storage/marker_file.h"

namespace veduta {

// Writes the marker file into an existing folder and makes it and the folder's entry in its parent
// durable.
Status WriteMarker(rocksdb::FileSystem& file_system, const std::string& folder);

// Why a database did not open, where whoever repairs it does something else then.
enum class OpenTrouble : uint8_t {
  kAny,          // or none
  kOtherFormat,  // its format, or a family, is not ours: no damage
  kLostFamily,   // a family that its format has is not there
};

class DatabaseOpener final {
 public:
  DatabaseOpener(std::string path, const DatabaseOptions& options);
  // For salvage: opens whatever RocksDB can read of the log.
  void AcceptDamagedLog() { accepts_damaged_log_ = true; }
  Result<std::shared_ptr<DatabaseFiles>> Open();
  OpenTrouble trouble() const { return trouble_; }  // of Open

 private:
  Status ListFolder();
  Status CheckFolder() const;
  Status PrepareFolder();
  Status ListFamilies();
  Status ReportUnknownFamily(const std::string& name);
  Status CheckLogs();
  Status OpenRocksdb();
  Status HoldView();
  Status CreateMissingFamilies();
  Status CheckFormat();
  Status CheckFamilies(uint32_t format);  // those that the format has
  Status Upgrade(uint32_t version);
  Status FinishCreation();
  bool Holds(const std::string& file) const;
  bool HoldsTables() const;
  rocksdb::DBOptions RocksdbOptions() const;

  DatabaseOptions options_;
  std::shared_ptr<DatabaseFiles> files_;
  std::vector<std::string> children_;  // of the folder, as it was found
  std::vector<Family> families_;       // that the database has already
  std::shared_ptr<rocksdb::Cache> cache_;
  std::shared_ptr<HeldFiles> held_files_;  // null for writing
  bool folder_exists_ = false;
  bool accepts_damaged_log_ = false;
  OpenTrouble trouble_ = OpenTrouble::kAny;
};

}  // namespace veduta
