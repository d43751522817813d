// SPDX-License-Identifier: Apache-2.0
#include "storage/families.h"

#include <rocksdb/filter_policy.h>
#include <rocksdb/listener.h>
#include <rocksdb/table.h>

#include <array>

#include "storage/postings_merge.h"

namespace veduta {
namespace {

constexpr std::array<const char*, kFamilyCount> kNames = {
    "meta",     "cameras",         "names",   "hashes",       "photos", "features",   "images",
    "pairs",    "reconstructions", "poses",   "observations", "points", "vocabulary", "words",
    "postings", "queue",           "journal", "dense",        "depth",  "volume",     "surface"};

// Values that are never merged with others and would only be carried along by compactions.
bool IsBlobFamily(Family family) {
  return family == Family::kPhotos || family == Family::kFeatures ||
         family == Family::kVocabulary || family == Family::kDepth || family == Family::kSurface;
}

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

size_t WriteBufferBytes(Family family) {
  switch (family) {
    case Family::kPhotos:
    case Family::kFeatures:
    case Family::kDepth:
      return 64u << 20;
    case Family::kPoints:
    case Family::kPostings:
    case Family::kPairs:
    case Family::kVolume:
    case Family::kSurface:
      return 32u << 20;
    default:
      return 8u << 20;
  }
}

}  // namespace

const char* FamilyName(Family family) {
  return kNames[static_cast<size_t>(family)];
}

std::optional<Family> FindFamily(std::string_view name) {
  for (size_t i = 0; i < kFamilyCount; ++i) {
    if (name == kNames[i]) return static_cast<Family>(i);
  }
  return std::nullopt;
}

rocksdb::ColumnFamilyOptions FamilyOptions(Family family,
                                           const std::shared_ptr<rocksdb::Cache>& cache) {
  rocksdb::BlockBasedTableOptions table;
  table.block_cache = cache;
  table.checksum = rocksdb::kXXH3;  // Debian's build computes CRC32C without the processor's help
  table.format_version = 5;
  table.filter_policy.reset(rocksdb::NewBloomFilterPolicy(10));
  table.cache_index_and_filter_blocks = true;  // so that block_cache_bytes bounds them too
  table.pin_l0_filter_and_index_blocks_in_cache = true;

  rocksdb::ColumnFamilyOptions options;
  options.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));
  options.write_buffer_size = WriteBufferBytes(family);
  options.level_compaction_dynamic_level_bytes = true;
  options.compression = rocksdb::kLZ4Compression;
  options.paranoid_file_checks =
      false;  // reading every written file back doubles compaction; blocks are checksummed
  if (IsBlobFamily(family)) {
    options.enable_blob_files = true;
    options.min_blob_size = 64;
    options.blob_file_size = 256u << 20;
    options.enable_blob_garbage_collection = true;
    // JPEGs are compressed already. Features: zstd takes a quarter off (LZ4 a twentieth), but adds
    // 0.4 ms to each of the dozens of reads that matching one new photo takes.
    options.blob_compression_type = family == Family::kDepth || family == Family::kSurface
                                        ? rocksdb::kZSTD
                                        : rocksdb::kNoCompression;
  }
  // No memtable_insert_with_hint_prefix_extractor, tempting as it is for thousands of ascending
  // words a commit (a fifth of its time): RocksDB 7.8 carries the hint over into the list of range
  // deletions, and corrupts memory.
  if (family == Family::kPostings) options.merge_operator = MakePostingsMerge();
  return options;
}

rocksdb::DBOptions DatabaseWideOptions() {
  rocksdb::DBOptions options;
  options.paranoid_checks = true;
  // A torn tail after a power cut is dropped. What a sync has acknowledged lies before it.
  options.wal_recovery_mode = rocksdb::WALRecoveryMode::kPointInTimeRecovery;
  options.max_bgerror_resume_count =
      0;  // a failed write stays failed until the database is opened again
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
