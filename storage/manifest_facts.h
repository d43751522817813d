// SPDX-License-Identifier: Apache-2.0
#pragma once
// What RocksDB's manifest says about the write-ahead log.

#include <rocksdb/file_system.h>

#include <cstdint>
#include <memory>
#include <string>

#include "storage/base/status.h"

namespace veduta {

struct ManifestFacts {
  uint64_t last_sequence = 0;  // of the writes so far when the manifest was last written
  uint64_t first_log = 0;      // all that older logs hold is in table files
};

// Opens RocksDB for reading, without the log, the tables and a lock: changes nothing, milliseconds.
// What RocksDB says where CURRENT or the manifest is damaged or missing.
Result<ManifestFacts> ReadManifestFacts(const std::string& path,
                                        const std::shared_ptr<rocksdb::FileSystem>& file_system);

}  // namespace veduta
