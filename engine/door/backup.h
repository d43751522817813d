// SPDX-License-Identifier: Apache-2.0
#pragma once
// Backups of a database, and the folder that keeps them.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

struct BackupRequest {
  std::string folder;  // of this database's backups; made where it is missing
  uint32_t keep = 0;   // older backups than so many are deleted afterwards; 0: none

  Status Check() const;  // the first violated bound, named with its value
};

struct BackupAnswer {
  uint32_t number = 0;  // in its folder, from 1, ascending
  int64_t time_unix_s = 0;
  std::string database;  // the absolute path of what it is a backup of
  uint64_t files = 0, bytes = 0;
};

struct BackupReport {
  BackupAnswer backup;
  uint64_t copied_files = 0, copied_bytes = 0;  // that the folder did not have
  uint32_t deleted = 0;                         // older backups
};

struct BackupList {
  std::vector<BackupAnswer> backups;  // ascending numbers
  // Sentences: which file is damaged or missing, and which backups want it.
  std::vector<std::string> damage;
};

}  // namespace veduta
