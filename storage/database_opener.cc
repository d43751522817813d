// SPDX-License-Identifier: Apache-2.0
#include "storage/database_opener.h"

#include <rocksdb/file_system.h>
#include <rocksdb/write_batch.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "storage/durable_folder.h"
#include "storage/family_options.h"
#include "storage/folder_lock.h"
#include "storage/log_inspection.h"
#include "storage/log_names.h"
#include "storage/opening_gate.h"
#include "storage/records/image_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/state_record.h"
#include "storage/replay_limit.h"
#include "storage/rocksdb_status.h"
#include "storage/value_reader.h"
#include "storage/write_buffer.h"

namespace veduta {
namespace {

constexpr const char* kMarkerText =
    "This folder is a veduta database. Its files belong together: do not edit, add or remove "
    "any.\n";

bool EndsWith(std::string_view text, std::string_view end) {
  return text.ends_with(end);
}

// RocksDB has one code for every trouble with its LOCK file; only the words tell a held lock from,
// say, a folder without permission.
bool IsLockHeld(const rocksdb::Status& status) {
  const std::string words = status.ToString();
  if (!status.IsIOError() || words.find("/LOCK: ") == std::string::npos) return false;
  return words.find("While lock file") != std::string::npos ||
         words.find("lock hold by current process") != std::string::npos;
}

// Writes the keys of `names` as they are since format 3. O(images) of time and memory.
Status NameByContributor(const DatabaseFiles& files, WriteBuffer* batch) {
  const ValueReader reader(files, nullptr);
  std::vector<std::pair<std::string, std::string>> renamed;  // put once all old ones are deleted
  VEDUTA_RETURN_IF_ERROR(reader.Scan(
      Family::kNames, "", "", [&](std::string_view name, std::string_view value, bool*) {
        ImageId id;
        if (!DecodeU32(value, &id.value).ok()) return Status::Ok();  // damaged: verify names it
        ImageRecord image;
        const auto decode = [&](std::string_view bytes) { return Decode(bytes, id, &image); };
        const Result<bool> found = reader.Read(Family::kImages, ImageKey(id), decode);
        // The name of a damaged record is kept for its repair, without the contributor.
        if (!found.ok() && found.status().code() != StatusCode::kCorruption) return found.status();
        batch->Delete(Family::kNames, name);
        renamed.emplace_back(NameKey(name, found.ok() ? image.contributor : ""), value);
        return Status::Ok();
      }));
  for (const auto& [key, value] : renamed) batch->Put(Family::kNames, key, std::string_view(value));
  return Status::Ok();
}

}  // namespace

Status WriteMarker(rocksdb::FileSystem& file_system, const std::string& folder) {
  const std::string marker = folder + "/" + kMarkerFile;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(
      rocksdb::WriteStringToFile(&file_system, kMarkerText, marker, /*should_sync=*/true),
      "write " + marker));
  VEDUTA_RETURN_IF_ERROR(MakeFolderDurable(file_system, folder));
  const std::filesystem::path absolute =
      std::filesystem::path(folder).is_absolute()
          ? std::filesystem::path(folder).lexically_normal()
          : (std::filesystem::path(".") / folder).lexically_normal();
  const std::filesystem::path trimmed = absolute.has_filename() ? absolute : absolute.parent_path();
  const std::string parent = trimmed.has_parent_path() ? trimmed.parent_path().string() : ".";
  return MakeFolderDurable(file_system, parent);
}

DatabaseOpener::DatabaseOpener(std::string path, const DatabaseOptions& options)
    : options_(options), files_(new DatabaseFiles) {
  files_->path_ = std::move(path);
  files_->read_only_ = options.read_only;
  files_->sync_wal_ = options.sync_wal;
  files_->file_system_ = options.file_system ? options.file_system : rocksdb::FileSystem::Default();
  if (!options.read_only) {
    files_->file_system_ = std::make_shared<GatedDeletions>(files_->file_system_, files_->path_);
  } else if (!options.salvage) {
    files_->file_system_ = held_files_ = std::make_shared<HeldFiles>(files_->file_system_);
  }
  files_->env_ = rocksdb::NewCompositeEnv(files_->file_system_);
}

Result<std::shared_ptr<DatabaseFiles>> DatabaseOpener::Open() {
  if (files_->path_.empty()) return Status::InvalidArgument("the database's path is empty");
  VEDUTA_RETURN_IF_ERROR(options_.Check());
  VEDUTA_RETURN_IF_ERROR(ListFolder());
  if (options_.create) {
    VEDUTA_RETURN_IF_ERROR(PrepareFolder());
  } else {
    VEDUTA_RETURN_IF_ERROR(CheckFolder());
  }
  if (Holds("CURRENT")) {
    VEDUTA_RETURN_IF_ERROR(ListFamilies());
    VEDUTA_RETURN_IF_ERROR(CheckLogs());
  }
  const Status opened = OpenRocksdb();
  if (opened.code() == StatusCode::kBusy && options_.create) {
    return Status::AlreadyExists("there is a database at " + files_->path_ +
                                 " already, in use by another process");
  }
  VEDUTA_RETURN_IF_ERROR(opened);
  if (options_.salvage) {
    VEDUTA_RETURN_IF_ERROR(CheckFamilies(kFormatVersion));
    return std::move(files_);
  }
  VEDUTA_RETURN_IF_ERROR(options_.read_only ? HoldView() : files_->BeginAcknowledging());
  VEDUTA_RETURN_IF_ERROR(CheckFormat());
  return std::move(files_);
}

bool DatabaseOpener::Holds(const std::string& file) const {
  return std::find(children_.begin(), children_.end(), file) != children_.end();
}

bool DatabaseOpener::HoldsTables() const {
  return std::any_of(children_.begin(), children_.end(), [](const std::string& file) {
    return EndsWith(file, ".sst") || EndsWith(file, ".blob");
  });
}

Status DatabaseOpener::ListFolder() {
  rocksdb::FileSystem& fs = files_->file_system();
  bool is_folder = false;
  const rocksdb::IOStatus found = fs.FileExists(files_->path_, rocksdb::IOOptions(), nullptr);
  if (found.IsNotFound()) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(found, "look for " + files_->path_));
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(fs.IsDirectory(files_->path_, rocksdb::IOOptions(), &is_folder, nullptr),
                  "look at " + files_->path_));
  if (!is_folder)
    return Status::InvalidArgument(files_->path_ + " is a file, not a database's folder");
  folder_exists_ = true;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(fs.GetChildren(files_->path_, rocksdb::IOOptions(), &children_, nullptr),
                  "list folder " + files_->path_));
  std::erase_if(children_, [](const std::string& name) { return name == "." || name == ".."; });
  return Status::Ok();
}

Status DatabaseOpener::CheckFolder() const {
  const std::string& path = files_->path_;
  if (!folder_exists_)
    return Status::NotFound("there is no database at " + path + ": create one with 'veduta init'");
  if (!Holds(kMarkerFile))
    return Status::NotFound(path + " is not a veduta database: it has no file " + kMarkerFile);
  if (Holds("CURRENT")) return Status::Ok();
  if (HoldsTables())
    return Status::Corruption("the database at " + path + " has lost its file CURRENT");
  return Status::NotFound("the creation of the database at " + path +
                          " was interrupted: create it again");
}

Status DatabaseOpener::PrepareFolder() {
  const std::string& path = files_->path_;
  if (Holds(kMarkerFile)) {
    // Ours: complete, which CheckFormat finds out, or cut short, and then it is finished now.
    if (Holds("CURRENT") || !HoldsTables()) return Status::Ok();
    return Status::Corruption("the database at " + path + " has lost its file CURRENT");
  }
  if (!children_.empty()) {
    return Status::AlreadyExists("folder " + path +
                                 " is not empty and holds no veduta database: choose another");
  }
  rocksdb::FileSystem& fs = files_->file_system();
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(fs.CreateDirIfMissing(path, rocksdb::IOOptions(), nullptr),
                                     "create folder " + path));
  return WriteMarker(fs, path);
}

rocksdb::DBOptions DatabaseOpener::RocksdbOptions() const {
  rocksdb::DBOptions options = DatabaseWideOptions();
  options.listeners.push_back(files_->failures_);
  options.env = files_->env_.get();
  if (options_.read_only) {
    // Opens every table now, and keeps it open: held_files.h. A salvage may read beside a database
    // that has half of the allowed files open already: it takes half of the others. Chosen by hand;
    // not measured.
    options.max_open_files = options_.salvage ? options.max_open_files / 2 : -1;
  }
  return options;
}

Status DatabaseOpener::ListFamilies() {
  std::vector<std::string> names;
  const rocksdb::Status listed =
      rocksdb::DB::ListColumnFamilies(RocksdbOptions(), files_->path_, &names);
  if (listed.IsPathNotFound() && listed.ToString().find("MANIFEST") != std::string::npos) {
    return Status::Corruption("the database at " + files_->path_ +
                              " is damaged: its file CURRENT names a file that is not there (" +
                              listed.ToString() + "). 'veduta repair " + files_->path_ +
                              "' brings back what can be read");
  }
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(listed, "open the database at " + files_->path_));
  for (const std::string& name : names) {
    if (name == rocksdb::kDefaultColumnFamilyName) continue;
    const std::optional<Family> family = FindFamily(name);
    if (!family) return ReportUnknownFamily(name);
    families_.push_back(*family);
  }
  return Status::Ok();
}

// A later format may have more families, and RocksDB opens for writing only when all are given.
// Reading can do with fewer: enough to say which version it is.
Status DatabaseOpener::ReportUnknownFamily(const std::string& name) {
  const std::vector<rocksdb::ColumnFamilyDescriptor> descriptors = {
      {rocksdb::kDefaultColumnFamilyName, rocksdb::ColumnFamilyOptions()},
      {FamilyName(Family::kMeta), FamilyOptions(Family::kMeta, nullptr)}};
  const rocksdb::DBOptions options = RocksdbOptions();
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* db = nullptr;
  std::string version = "an unknown format";
  if (rocksdb::DB::OpenForReadOnly(options, files_->path_, descriptors, &handles, &db).ok()) {
    std::string value;
    uint32_t number = 0;
    if (db->Get(rocksdb::ReadOptions(), handles[1],
                rocksdb::Slice(kFormatKey.data(), kFormatKey.size()), &value)
            .ok() &&
        DecodeU32(value, &number).ok()) {
      version = "format " + std::to_string(number);
    }
    for (rocksdb::ColumnFamilyHandle* handle : handles)
      db->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
    delete db;
  }
  trouble_ = OpenTrouble::kOtherFormat;
  return Status::Corruption("the database at " + files_->path_ + " has " + version +
                            " with a family '" + name + "'; this program knows format " +
                            std::to_string(kFormatVersion));
}

// Before RocksDB is opened for writing: it deletes the logs, whole or not.
Status DatabaseOpener::CheckLogs() {
  if (accepts_damaged_log_) return Status::Ok();
  if (options_.read_only) {
    VEDUTA_ASSIGN_OR_RETURN(const LogDamage damage, InspectLogs(files_->path_, options_));
    if (damage.damaged()) return DamagedLogStatus(files_->path_, damage);
    if (damage.last_replayed_sequence)
      files_->replay_limit_ = MakeReplayLimit(*damage.last_replayed_sequence, damage.last_log);
    return Status::Ok();
  }
  const Result<FolderLock> lock = FolderLock::Take(files_->path_, files_->shared_file_system());
  if (!lock.ok()) return Status::Ok();  // RocksDB will not get it, either; OpenRocksdb says why
  VEDUTA_ASSIGN_OR_RETURN(const LogDamage damage, InspectLogs(files_->path_, options_));
  if (damage.damaged()) return DamagedLogStatus(files_->path_, damage);
  // What is cut off is not replayed: there is no need of a limit. Before RocksDB takes the lock,
  // another process may open the database and commit more, which a limit would lose.
  return CutForgivenEnd(files_->file_system(), files_->path_, damage);
}

Status DatabaseOpener::OpenRocksdb() {
  cache_ = rocksdb::NewLRUCache(options_.block_cache_bytes);
  std::vector<rocksdb::ColumnFamilyDescriptor> descriptors = {
      {rocksdb::kDefaultColumnFamilyName, rocksdb::ColumnFamilyOptions()}};
  for (const Family family : families_)
    descriptors.emplace_back(FamilyName(family), FamilyOptions(family, cache_));
  rocksdb::DBOptions options = RocksdbOptions();
  options.create_if_missing = options_.create;
  options.wal_filter = files_->replay_limit_.get();

  rocksdb::DB* db = nullptr;
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  const rocksdb::Status status =
      options_.read_only
          ? rocksdb::DB::OpenForReadOnly(options, files_->path_, descriptors, &handles, &db)
          : rocksdb::DB::Open(options, files_->path_, descriptors, &handles, &db);
  if (IsLockHeld(status)) {
    return Status::Busy("the database at " + files_->path_ +
                        " is in use by another veduta process; wait for it or stop it");
  }
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(status, "open the database at " + files_->path_));
  files_->db_.reset(db);
  files_->default_handle_ = handles[0];
  for (size_t i = 0; i < families_.size(); ++i)
    files_->handles_[static_cast<size_t>(families_[i])] = handles[i + 1];

  return options_.create ? CreateMissingFamilies() : Status::Ok();
}

// Makes sure that what RocksDB has just opened is one state of the database, and stays readable.
Status DatabaseOpener::HoldView() {
  for (const Family family : families_)
    VEDUTA_RETURN_IF_ERROR(held_files_->HoldBlobFiles(files_->db(), files_->handle(family)));
  // RocksDB has read the manifest and then the logs. A log that a writer has deleted in between is
  // in table files that this manifest does not name.
  uint64_t first_log = 0;
  files_->db().GetIntProperty(rocksdb::DB::Properties::kMinLogNumberToKeep, &first_log);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<uint64_t> logs,
                          ListLogs(files_->file_system(), files_->path_));
  // RocksDB deletes logs in their order: where the newest of those that were found before is still
  // there, no log has come and gone since.
  uint64_t newest = 0;
  for (const std::string& name : children_)
    newest = std::max(newest, ParseLogName(name).value_or(0));
  for (const std::string& name : children_) {
    const std::optional<uint64_t> log = ParseLogName(name);
    const bool is_needed = log && (*log >= first_log || *log == newest);
    if (is_needed && std::find(logs.begin(), logs.end(), *log) == logs.end())
      return Status::IoError(name + " of the database at " + files_->path_ +
                             " was deleted while it was opened: open it again");
  }
  return Status::Ok();
}

Status DatabaseOpener::CreateMissingFamilies() {
  if (families_.size() == kFamilyCount) return Status::Ok();
  std::vector<rocksdb::ColumnFamilyDescriptor> missing;
  std::vector<Family> missing_families;
  for (size_t i = 0; i < kFamilyCount; ++i) {
    if (files_->handles_[i] != nullptr) continue;
    const Family family = static_cast<Family>(i);
    missing.emplace_back(FamilyName(family), FamilyOptions(family, cache_));
    missing_families.push_back(family);
  }
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  const rocksdb::Status created = files_->db().CreateColumnFamilies(missing, &handles);
  // Where only some were created, the handles of those are given: they have to be destroyed too.
  for (size_t i = 0; i < handles.size(); ++i)
    files_->handles_[static_cast<size_t>(missing_families[i])] = handles[i];
  return FromRocksdb(created, "create the families of the database at " + files_->path_);
}

Status DatabaseOpener::CheckFormat() {
  const std::string& path = files_->path_;
  std::string value;
  rocksdb::Status status = rocksdb::Status::NotFound();
  if (files_->handle(Family::kMeta) != nullptr) {
    status = files_->db().Get(rocksdb::ReadOptions(), files_->handle(Family::kMeta),
                              rocksdb::Slice(kFormatKey.data(), kFormatKey.size()), &value);
  }
  if (status.IsNotFound()) {
    if (options_.create) return FinishCreation();
    return Status::NotFound("the creation of the database at " + path +
                            " was interrupted: create it again");
  }
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(status, "read the format of the database at " + path));
  uint32_t version = 0;
  if (!DecodeU32(value, &version).ok())
    return Status::Corruption("family meta, key 'format': no version number");
  if (version > 0 && version < kFormatVersion && !options_.create) {
    if (!options_.read_only) return Upgrade(version);
    return Status::Corruption("the database at " + path + " has format " + std::to_string(version) +
                              " of an earlier veduta: 'veduta settle " + path +
                              "' brings it to format " + std::to_string(kFormatVersion));
  }
  if (version != kFormatVersion) {
    trouble_ = OpenTrouble::kOtherFormat;
    return Status::Corruption("the database at " + path + " has format " + std::to_string(version) +
                              "; this program knows format " + std::to_string(kFormatVersion));
  }
  if (options_.create) return Status::AlreadyExists("there is a database at " + path + " already");
  return CheckFamilies(kFormatVersion);
}

Status DatabaseOpener::CheckFamilies(uint32_t format) {
  for (const FamilyTraits& traits : AllFamilies()) {
    if (traits.since_format > format || files_->handle(traits.family) != nullptr) continue;
    trouble_ = OpenTrouble::kLostFamily;
    return Status::Corruption("the database at " + files_->path_ + " has lost its family " +
                              traits.name);
  }
  return Status::Ok();
}

// Format 1 had no families for the dense pass; until format 2 the keys of `names` did not tell the
// contributor; until format 3 there was no family for photos that wait, until format 4 nothing that
// places the city on the earth, until format 5 no merge that is open, and until format 6 no
// contribution. The rest is the same. The version is written last, with the names: whoever is
// killed on the way upgrades again.
Status DatabaseOpener::Upgrade(uint32_t version) {
  VEDUTA_RETURN_IF_ERROR(CheckFamilies(version));
  VEDUTA_RETURN_IF_ERROR(CreateMissingFamilies());
  WriteBuffer batch(*files_);
  if (version < 3) {
    VEDUTA_RETURN_IF_ERROR(NameByContributor(*files_, &batch));
  }
  const std::string newest = EncodeU32(kFormatVersion);
  batch.Put(Family::kMeta, kFormatKey, std::string_view(newest));
  return batch.Write(/*sync=*/true, "upgrade the database at " + files_->path_);
}

Status DatabaseOpener::FinishCreation() {
  VEDUTA_ASSIGN_OR_RETURN(const std::string state, Encode(DatabaseState{}));
  rocksdb::WriteBatch batch;
  rocksdb::ColumnFamilyHandle* meta = files_->handle(Family::kMeta);
  rocksdb::Status put = batch.Put(meta, rocksdb::Slice(kStateKey.data(), kStateKey.size()), state);
  if (put.ok())
    put = batch.Put(meta, rocksdb::Slice(kFormatKey.data(), kFormatKey.size()),
                    EncodeU32(kFormatVersion));
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(put, "create the database"));
  return files_->Write(&batch, /*sync=*/true, "create the database at " + files_->path_);
}

namespace {

// Where the gate is held, one attempt is enough, but for a log that is replaced meanwhile. Where a
// file system has no such locks, a writer's flush or compaction moves files within milliseconds,
// and makes some ten a second at most. Where there are far more readers than cores, an attempt may
// take seconds, and longer than a writer waits at the gate: time alone does not end them. All
// chosen by hand.
constexpr std::chrono::seconds kPatienceBesideWriter(20);
constexpr int kAttemptsMin = 10;
constexpr std::chrono::milliseconds kBetweenAttempts(20);

std::vector<std::string> NamesIn(rocksdb::FileSystem& file_system, const std::string& folder) {
  std::vector<std::string> names;
  file_system.GetChildren(folder, rocksdb::IOOptions(), &names, nullptr).PermitUncheckedError();
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Result<std::shared_ptr<DatabaseFiles>> DatabaseFiles::Open(const std::string& path,
                                                           const DatabaseOptions& options) {
  if (!options.read_only) return DatabaseOpener(path, options).Open();
  const std::shared_ptr<rocksdb::FileSystem> file_system =
      options.file_system ? options.file_system : rocksdb::FileSystem::Default();
  const auto end = std::chrono::steady_clock::now() + kPatienceBesideWriter;
  for (int attempt = 1;; ++attempt) {
    const std::vector<std::string> before = NamesIn(*file_system, path);
    Result<std::shared_ptr<DatabaseFiles>> opened = [&] {
      const OpeningGate gate = OpeningGate::EnterToOpen(path);
      return DatabaseOpener(path, options).Open();
    }();
    // Where no file has come or gone, nobody was writing, and the reason is the database's own.
    const bool is_enough = attempt >= kAttemptsMin && std::chrono::steady_clock::now() > end;
    if (opened.ok() || is_enough || NamesIn(*file_system, path) == before) return opened;
    std::this_thread::sleep_for(kBetweenAttempts);
  }
}

}  // namespace veduta
