// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace veduta {

struct DatabaseSizes {
  uint64_t total_bytes = 0;                     // files on disk
  uint64_t photo_bytes = 0, feature_bytes = 0;  // in files, and in memory by the MiB
};

// What was written and read since the database was opened by this process; by RocksDB's counters.
struct DatabaseStatistics {
  // Written: the sum of these three is everything but what RocksDB writes about itself.
  uint64_t log_bytes = 0;         // to the write-ahead log
  uint64_t flush_bytes = 0;       // to tables and blob files, from memory
  uint64_t compaction_bytes = 0;  // to tables and blob files, from older ones
  // Parts of that: to blob files, and of these what was copied to be rid of garbage beside it.
  uint64_t blob_bytes = 0, blob_copied_bytes = 0;
  uint64_t cache_hits = 0, cache_misses = 0;  // of blocks of tables
};

}  // namespace veduta
