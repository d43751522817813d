// SPDX-License-Identifier: Apache-2.0
#include "storage/family_options.h"

#include <rocksdb/filter_policy.h>
#include <rocksdb/listener.h>
#include <rocksdb/statistics.h>
#include <rocksdb/table.h>

#include <algorithm>
#include <thread>

#include "storage/open_files.h"
#include "storage/postings_merge.h"
#include "storage/silent_logger.h"

namespace veduta {
namespace {

// RocksDB 7.8 watches a full disk and resumes by itself when there is room. Closing the database
// meanwhile may wait for ever (found by tests/storage/fault_sweep_test.cc), and a write after a
// failed one is not ours to acknowledge before the log has been read again: so it is told not to.
class NoAutoRecovery final : public rocksdb::EventListener {
 public:
  void OnErrorRecoveryBegin(rocksdb::BackgroundErrorReason /*reason*/, rocksdb::Status /*error*/,
                            bool* auto_recovery) override {
    *auto_recovery = false;
  }
};

}  // namespace

rocksdb::ColumnFamilyOptions FamilyOptions(Family family,
                                           const std::shared_ptr<rocksdb::Cache>& cache) {
  rocksdb::BlockBasedTableOptions table;
  table.block_cache = cache;
  table.checksum = rocksdb::kXXH3;  // Debian's build computes CRC32C without the processor's help
  table.format_version = 5;
  table.filter_policy.reset(rocksdb::NewBloomFilterPolicy(10));
  table.cache_index_and_filter_blocks = true;  // so that block_cache_bytes bounds them too
  table.pin_l0_filter_and_index_blocks_in_cache = true;
  // Index and filter of a table are cut into blocks, of which a read needs one each. Only the top
  // of the index stays in memory with the open table.
  table.index_type = rocksdb::BlockBasedTableOptions::kTwoLevelIndexSearch;
  table.partition_filters = true;
  table.pin_top_level_index_and_filter = true;

  const FamilyTraits& traits = TraitsOf(family);
  rocksdb::ColumnFamilyOptions options;
  options.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));
  options.write_buffer_size = size_t{traits.write_buffer_mib} << 20;
  options.level_compaction_dynamic_level_bytes = true;
  options.compression = rocksdb::kLZ4Compression;
  // Reading every written file back doubles the work of a compaction, and blocks have checksums.
  options.paranoid_file_checks = false;
  if (traits.store != ValueStore::kTable) {
    options.enable_blob_files = true;
    options.min_blob_size = 64;
    options.blob_file_size = 256u << 20;
    options.enable_blob_garbage_collection = !traits.written_once;
    options.blob_compression_type =
        traits.store == ValueStore::kCompressedBlob ? rocksdb::kZSTD : rocksdb::kNoCompression;
  }
  // No memtable_insert_with_hint_prefix_extractor, tempting as it is for thousands of ascending
  // words a commit (a fifth of its time): RocksDB 7.8 carries the hint over into the list of range
  // deletions, and corrupts memory.
  if (traits.unites_ids) options.merge_operator = MakePostingsMerge();
  return options;
}

namespace {

// One job for each core, for flushes and compactions together: at least 2, so that a flush does not
// wait for a compaction, and at most 8, which write more than most disks take. Chosen by hand; not
// measured.
int BackgroundJobs() {
  return static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 2u, 8u));
}

// A database of 1 TB has about 8,000 tables and blob files: 256 MiB is the size of a blob file, and
// 64 MiB that of a table. An open one costs some KiB of memory. The other half of what the process
// may open is left to it. Chosen by hand; not measured.
constexpr uint64_t kOpenFilesMax = 8192;

int OpenFiles() {
  AllowManyOpenFiles();
  return static_cast<int>(std::min(kOpenFilesMax, OpenFilesAllowed() / 2));
}

}  // namespace

rocksdb::DBOptions DatabaseWideOptions() {
  rocksdb::DBOptions options;
  options.paranoid_checks = true;
  // A torn tail after a power cut is dropped. What a sync has acknowledged lies before it.
  options.wal_recovery_mode = rocksdb::WALRecoveryMode::kPointInTimeRecovery;
  // A failed write stays failed until the database is opened again.
  options.max_bgerror_resume_count = 0;
  options.listeners = {std::make_shared<NoAutoRecovery>()};
  options.max_background_jobs = BackgroundJobs();
  options.max_open_files = OpenFiles();
  options.db_write_buffer_size = 192u << 20;  // memory bound over all families
  options.max_total_wal_size = 256u << 20;    // bound on what Open has to replay
  options.bytes_per_sync = 1u << 20;
  // Debian builds RocksDB with its assertions, and one of them ends the process at the second line
  // of its own log that a full disk does not take.
  options.info_log = std::make_shared<SilentLogger>();
  // Counters without clocks: DatabaseStatistics.
  options.statistics = rocksdb::CreateDBStatistics();
  options.statistics->set_stats_level(rocksdb::StatsLevel::kExceptHistogramOrTimers);
  options.stats_dump_period_sec = 0;
  options.stats_persist_period_sec = 0;
  return options;
}

}  // namespace veduta
