// SPDX-License-Identifier: Apache-2.0
#include "storage/manifest_facts.h"

#include <rocksdb/db.h>
#include <rocksdb/wal_filter.h>

#include <optional>
#include <vector>

#include "storage/family_options.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// Ends the replay before its first record: what RocksDB then knows is what the manifest says.
class NoReplay final : public rocksdb::WalFilter {
 public:
  const char* Name() const override { return "veduta.NoReplay"; }
  WalProcessingOption LogRecordFound(unsigned long long /*log*/, const std::string& /*file*/,
                                     const rocksdb::WriteBatch& /*batch*/,
                                     rocksdb::WriteBatch* /*changed*/,
                                     bool* /*is_changed*/) override {
    return WalProcessingOption::kStopReplay;
  }
};

}  // namespace

Result<ManifestFacts> ReadManifestFacts(const std::string& path,
                                        const std::shared_ptr<rocksdb::FileSystem>& file_system) {
  const std::string doing = "open the database at " + path;
  const std::unique_ptr<rocksdb::Env> env = rocksdb::NewCompositeEnv(file_system);
  NoReplay no_replay;
  rocksdb::DBOptions options = DatabaseWideOptions();
  options.env = env.get();
  options.wal_filter = &no_replay;
  // Recovery to a point in time fails where the first record is damaged and one family has a table
  // of later writes. The logs are not replayed here, so it does not matter what is damaged in them.
  options.wal_recovery_mode = rocksdb::WALRecoveryMode::kSkipAnyCorruptedRecords;
  options.skip_stats_update_on_db_open = true;
  options.skip_checking_sst_file_sizes_on_db_open = true;

  std::vector<std::string> names;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(rocksdb::DB::ListColumnFamilies(options, path, &names), doing));
  std::vector<rocksdb::ColumnFamilyDescriptor> families;
  for (const std::string& name : names) {
    const std::optional<Family> known = FindFamily(name);
    families.emplace_back(name,
                          known ? FamilyOptions(*known, nullptr) : rocksdb::ColumnFamilyOptions());
  }
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* raw = nullptr;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(rocksdb::DB::OpenForReadOnly(options, path, families, &handles, &raw), doing));
  const std::unique_ptr<rocksdb::DB> db(raw);
  ManifestFacts facts;
  facts.last_sequence = db->GetLatestSequenceNumber();
  const bool known =
      db->GetIntProperty(rocksdb::DB::Properties::kMinLogNumberToKeep, &facts.first_log);
  for (rocksdb::ColumnFamilyHandle* handle : handles)
    db->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
  if (!known) return Status::IoError("cannot " + doing + ": RocksDB does not know its first log");
  return facts;
}

}  // namespace veduta
