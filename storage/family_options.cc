// SPDX-License-Identifier: Apache-2.0
#include "storage/family_options.h"

#include <rocksdb/filter_policy.h>
#include <rocksdb/listener.h>
#include <rocksdb/table.h>

#include "storage/postings_merge.h"

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
    options.enable_blob_garbage_collection = true;
    options.blob_compression_type =
        traits.store == ValueStore::kCompressedBlob ? rocksdb::kZSTD : rocksdb::kNoCompression;
  }
  // No memtable_insert_with_hint_prefix_extractor, tempting as it is for thousands of ascending
  // words a commit (a fifth of its time): RocksDB 7.8 carries the hint over into the list of range
  // deletions, and corrupts memory.
  if (traits.unites_ids) options.merge_operator = MakePostingsMerge();
  return options;
}

rocksdb::DBOptions DatabaseWideOptions() {
  rocksdb::DBOptions options;
  options.paranoid_checks = true;
  // A torn tail after a power cut is dropped. What a sync has acknowledged lies before it.
  options.wal_recovery_mode = rocksdb::WALRecoveryMode::kPointInTimeRecovery;
  // A failed write stays failed until the database is opened again.
  options.max_bgerror_resume_count = 0;
  options.listeners = {std::make_shared<NoAutoRecovery>()};
  options.max_background_jobs = 2;
  options.max_open_files = 1000;
  options.db_write_buffer_size = 192u << 20;  // memory bound over all families
  options.max_total_wal_size = 256u << 20;    // bound on what Open has to replay
  options.bytes_per_sync = 1u << 20;
  options.info_log_level = rocksdb::InfoLogLevel::WARN_LEVEL;
  options.keep_log_file_num = 2;
  options.max_log_file_size = 1u << 20;
  options.stats_dump_period_sec = 0;
  options.stats_persist_period_sec = 0;
  return options;
}

}  // namespace veduta
