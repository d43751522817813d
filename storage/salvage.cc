// SPDX-License-Identifier: Apache-2.0
#include "storage/salvage.h"

#include <rocksdb/convenience.h>
#include <rocksdb/db.h>
#include <rocksdb/file_system.h>
#include <rocksdb/sst_file_reader.h>
#include <rocksdb/table_properties.h>
#include <rocksdb/write_batch.h>

#include <filesystem>
#include <set>
#include <utility>

#include "storage/acknowledged.h"
#include "storage/base/system_status.h"
#include "storage/database_files.h"
#include "storage/database_opener.h"
#include "storage/family_options.h"
#include "storage/log_salvage.h"
#include "storage/records/image_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/state_record.h"
#include "storage/rocksdb_status.h"
#include "storage/snapshot_view.h"
#include "storage/value_reader.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

// RocksDB never changes a table or a blob file once it is written: links to them will do.
bool IsNeverChanged(const fs::path& file) {
  return file.extension() == ".sst" || file.extension() == ".blob";
}

Status TakeFile(const fs::path& from, const fs::path& to) {
  std::error_code error;
  if (IsNeverChanged(from)) {
    fs::create_hard_link(from, to, error);
    if (!error) return Status::Ok();
    error.clear();  // a file system without links
  }
  fs::copy_file(from, to, error);
  return FromSystem(error, "copy " + from.string() + " to " + to.string());
}

Status FillScratch(const std::string& path, const std::string& scratch,
                   std::vector<std::string>* damage) {
  std::error_code error;
  fs::create_directory(scratch, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "make folder " + scratch));
  fs::directory_iterator entries(path, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "list folder " + path));
  for (; entries != fs::directory_iterator(); entries.increment(error)) {
    const fs::path file = entries->path();
    const std::string name = file.filename().string();
    if (!fs::is_regular_file(file, error) || name == "LOCK" || name.starts_with("LOG")) continue;
    const Status taken = TakeFile(file, fs::path(scratch) / name);
    if (!taken.ok()) damage->push_back("file " + name + " cannot be read: " + taken.message());
  }
  return FromSystem(error, "list folder " + path);
}

std::vector<rocksdb::ColumnFamilyDescriptor> AllDescriptors() {
  std::vector<rocksdb::ColumnFamilyDescriptor> descriptors = {
      {rocksdb::kDefaultColumnFamilyName, rocksdb::ColumnFamilyOptions()}};
  for (const FamilyTraits& traits : AllFamilies()) {
    descriptors.emplace_back(traits.name, FamilyOptions(traits.family, nullptr));
    descriptors.back().options.disable_auto_compactions = true;
  }
  return descriptors;
}

// Above every number that RocksDB has given to a file. Chosen by hand.
constexpr uint64_t kSeedNumber = 100'000'000;

// Two tables of one family must not end with the same write. Chosen by hand, far above what a young
// database has written before its first table.
constexpr uint32_t kSeedSequence = 100'003;

// The names of the families that have a table.
std::set<std::string> FamiliesOfTables(const std::string& folder) {
  std::set<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".sst") continue;
    rocksdb::SstFileReader reader{rocksdb::Options()};
    if (!reader.Open(entry.path().string()).ok()) continue;
    if (const auto properties = reader.GetTableProperties())
      names.insert(properties->column_family_name);
  }
  return names;
}

// Adds a table to each family that has none. RocksDB's repair knows families by their tables alone:
// without one, it would drop from the logs what a young database has in them. The families get the
// numbers that they have in every database, since they are created in the same order. The one key
// sorts last, and is none of ours.
Status SeedFamilies(const std::string& scratch) {
  const std::string folder = scratch + "/seed";
  rocksdb::DBOptions options = DatabaseWideOptions();
  options.create_if_missing = options.create_missing_column_families = true;
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* db = nullptr;
  rocksdb::Status status = rocksdb::DB::Open(options, folder, AllDescriptors(), &handles, &db);
  rocksdb::WriteBatch batch;
  for (uint32_t i = 0; i < kSeedSequence; ++i)
    if (status.ok()) status = batch.Delete("\xFF");
  if (status.ok()) status = db->Write(rocksdb::WriteOptions(), &batch);
  const std::set<std::string> known = FamiliesOfTables(scratch);
  for (rocksdb::ColumnFamilyHandle* handle : handles) {
    if (!known.contains(handle->GetName())) {
      if (status.ok()) status = db->Put(rocksdb::WriteOptions(), handle, "\xFF", "");
      if (status.ok()) status = db->Flush(rocksdb::FlushOptions(), handle);
    }
    db->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
  }
  delete db;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(status, "make tables in " + folder));
  std::error_code error;
  uint64_t number = kSeedNumber;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".sst") continue;
    const fs::path link = fs::path(scratch) / (std::to_string(++number) + ".sst");
    VEDUTA_RETURN_IF_ERROR(TakeFile(entry.path(), link));
  }
  return FromSystem(error, "list folder " + folder);
}

// Makes the families that the files have lost, empty.
Status AddLostFamilies(const std::string& folder) {
  rocksdb::DBOptions options = DatabaseWideOptions();
  options.create_missing_column_families = true;
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* db = nullptr;
  const rocksdb::Status opened =
      rocksdb::DB::Open(options, folder, AllDescriptors(), &handles, &db);
  if (opened.ok()) {
    for (rocksdb::ColumnFamilyHandle* handle : handles)
      db->DestroyColumnFamilyHandle(handle).PermitUncheckedError();
    rocksdb::CancelAllBackgroundWork(db, true);
  }
  delete db;
  return FromRocksdb(opened, "open " + folder);
}

}  // namespace

Salvage::Salvage(std::string path, std::string scratch, const DatabaseOptions& options)
    : path_(std::move(path)), scratch_(std::move(scratch)), options_(options) {
  options_.create = false;
  options_.read_only = true;
  options_.salvage = true;
}

Salvage::~Salvage() = default;

Result<std::unique_ptr<Salvage>> Salvage::Open(const std::string& path, const std::string& scratch,
                                               const DatabaseOptions& options) {
  std::error_code error;
  if (!fs::is_directory(path, error))
    return Status::NotFound("there is no database at " + path + ": create one with 'veduta init'");
  std::unique_ptr<Salvage> salvage(new Salvage(path, scratch, options));
  VEDUTA_RETURN_IF_ERROR(FillScratch(path, scratch, &salvage->damage_));
  if (!fs::exists(fs::path(scratch) / kMarkerFile, error)) {
    salvage->damage_.push_back(std::string("file ") + kMarkerFile + " is missing");
    VEDUTA_RETURN_IF_ERROR(WriteMarker(*rocksdb::FileSystem::Default(), scratch));
  }
  const Status opened = salvage->OpenScratch();
  VEDUTA_RETURN_IF_ERROR(salvage->RefuseOtherFormat(opened));
  if (opened.ok()) return salvage;
  salvage->damage_.push_back("the files do not open as they are: " + opened.message());
  SalvageLogs(scratch, options).IgnoreBecause("whether it helped, opening them again tells");
  if (salvage->OpenScratch().ok()) {
    salvage->log_was_damaged_ = true;
    return salvage;
  }
  salvage->is_pieced_together_ = true;
  const Status pieced = salvage->PieceTogether();
  if (pieced.ok()) return salvage;
  salvage->damage_.push_back("what the files of records hold cannot be found: " + pieced.message());
  VEDUTA_RETURN_IF_ERROR(salvage->StandIn());
  return salvage;
}

Status Salvage::OpenScratch() {
  const auto open = [&] {
    DatabaseOpener opener(scratch_, options_);
    Result<std::shared_ptr<DatabaseFiles>> opened = opener.Open();
    trouble_ = opener.trouble();
    return opened;
  };
  Result<std::shared_ptr<DatabaseFiles>> opened = open();
  if (trouble_ == OpenTrouble::kLostFamily) {  // format 1 has no families of the dense pass
    VEDUTA_RETURN_IF_ERROR(AddLostFamilies(scratch_));
    opened = open();
  }
  VEDUTA_RETURN_IF_ERROR(opened.status());
  files_ = std::move(*opened);
  snapshot_ = MakeSnapshot(files_);
  return Status::Ok();
}

// What a later program has written looks like damage to this one, and is none. What an earlier one
// has written can be read, and is written anew in today's format.
Status Salvage::RefuseOtherFormat(const Status& opened) {
  if (!opened.ok()) return trouble_ == OpenTrouble::kOtherFormat ? opened : Status::Ok();
  ValueReader(*files_, nullptr)
      .Read(Family::kMeta, kFormatKey,
            [&](std::string_view value) { return DecodeU32(value, &format_); })
      .status()
      .IgnoreBecause("a number that is damaged tells of no other format");
  if (format_ <= kFormatVersion) return Status::Ok();
  return Status::InvalidArgument("the database at " + path_ + " has format " +
                                 std::to_string(format_) + "; this program repairs formats up to " +
                                 std::to_string(kFormatVersion) +
                                 ": repair it with the program that wrote it");
}

// RocksDB's own repair finds the tables without the manifest, and reads the logs. It does not know
// blob files: BlobSearch does.
Status Salvage::PieceTogether() {
  std::error_code ignored;  // what was acknowledged may not be there any more
  fs::remove(fs::path(scratch_) / kAcknowledgedFile, ignored);
  VEDUTA_RETURN_IF_ERROR(SeedFamilies(scratch_));
  const std::vector<rocksdb::ColumnFamilyDescriptor> descriptors = AllDescriptors();
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(rocksdb::RepairDB(scratch_, DatabaseWideOptions(), descriptors),
                  "put the files of " + path_ + " together"));
  VEDUTA_RETURN_IF_ERROR(AddLostFamilies(scratch_));
  return OpenScratch();
}

Status Salvage::StandIn() {
  std::error_code error;
  fs::remove_all(scratch_, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "delete folder " + scratch_));
  DatabaseOptions create;
  create.create = true;
  VEDUTA_RETURN_IF_ERROR(Database::Open(scratch_, create).status());
  return OpenScratch();
}

const BlobSearch& Salvage::blobs() const {
  if (!blobs_) blobs_.emplace(path_);
  return *blobs_;
}

Result<std::vector<uint8_t>> Salvage::GetPhoto(const ContentHash& photo,
                                               uint64_t size_bytes) const {
  const Result<StoredBytes> stored = snapshot_->GetPhoto(photo);
  if (stored.ok() && HashContent(stored->bytes()) == photo)
    return std::vector<uint8_t>(stored->bytes().begin(), stored->bytes().end());
  if (std::optional<std::vector<uint8_t>> found = blobs().Find(photo, size_bytes))
    return std::move(*found);
  if (!stored.ok()) return stored.status();
  return Status::Corruption("the stored photo has another hash than " + photo.Hex());
}

void Salvage::ScanStrayPhotos(const std::function<bool(const ContentHash&)>& visit) const {
  blobs().Scan(visit);
}

Status Salvage::ScanNames(const std::function<void(const PhotoName&, ImageId)>& visit) const {
  return ValueReader(*files_, nullptr)
      .Scan(Family::kNames, "", "", [&](std::string_view key, std::string_view value, bool*) {
        ImageId image;
        PhotoName name;
        const bool is_alone = format_ == 1 || format_ == 2;
        if (is_alone || !ParseNameKey(key, &name)) name = {std::string(key), ""};
        if (DecodeU32(value, &image.value).ok() && image.valid()) visit(name, image);
        return Status::Ok();
      });
}

Status Salvage::ScanHashes(const std::function<void(const ContentHash&, ImageId)>& visit) const {
  return ValueReader(*files_, nullptr)
      .Scan(Family::kHashes, "", "", [&](std::string_view key, std::string_view value, bool*) {
        ImageId image;
        ContentHash hash;
        if (ParseHashKey(key, &hash) && DecodeU32(value, &image.value).ok() && image.valid())
          visit(hash, image);
        return Status::Ok();
      });
}

}  // namespace veduta
