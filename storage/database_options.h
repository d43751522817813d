// SPDX-License-Identifier: Apache-2.0
#pragma once
// How a database is opened.

#include <cstdint>
#include <memory>

#include "storage/base/status.h"

namespace rocksdb {
class FileSystem;
}

namespace veduta {

// 2: there is a dense pass. 3: contributors name their photos each for themselves.
inline constexpr uint32_t kFormatVersion = 7;

struct DatabaseOptions {
  // Makes a new database; kAlreadyExists if one is there.
  bool create = false;
  // No lock is taken, nothing is written and nothing swept; sees the state at the time of opening,
  // whatever another process writes meanwhile. Holds every table and blob file open
  // (storage/held_files.h).
  bool read_only = false;
  // With read_only, for a repair and the check of a copy, whose files nobody writes: the format is
  // not looked at, and files are opened when they are read, at most a quarter of those that the
  // process may open, so that one that is damaged does not keep the others from being read.
  bool salvage = false;
  // False: a power cut may lose the last photos (a crash of the process does not).
  bool sync_wal = true;
  // Memory for blocks of table files that were read: 1 MiB to 1 TiB. The default was chosen by
  // hand; not measured.
  uint64_t block_cache_bytes = 256ull << 20;
  // For tests; null is the operating system's.
  std::shared_ptr<rocksdb::FileSystem> file_system = nullptr;

  // kInvalidArgument naming the first violated bound with its value.
  Status Check() const;
};

}  // namespace veduta
