// SPDX-License-Identifier: Apache-2.0
#include "storage/value_reader.h"

#include <rocksdb/slice.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "storage/records/key_bytes.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

rocksdb::Slice AsSlice(std::string_view text) {
  return {text.data(), text.size()};
}

std::string Doing(Family family) {
  return std::string("read family ") + FamilyName(family);
}

// An iterator over one run of keys, which closing the files takes away.
//
// An iterator of RocksDB 7.8 that heeds deleted ranges may pass over a table that it cannot read,
// and end without a word, or crash, even when it is only made and given back (found by
// tests/storage/bad_days_test.cc). One that ignores them says so. Where ranges are deleted, such a
// one reads the whole run before the other is made, as a witness.
class Cursor final : private DatabaseFiles::Dependent {
 public:
  Cursor(const DatabaseFiles& files, Family family, const rocksdb::ReadOptions& options,
         std::string_view prefix, std::string_view first)
      : files_(files),
        family_(family),
        prefix_(prefix),
        end_(prefix.empty() ? std::string() : PrefixEnd(prefix)),
        end_slice_(end_),
        begin_(std::max(prefix, first)),
        options_(options) {
    options_.fill_cache = !TraitsOf(family).scanned_in_long_runs;
    if (!prefix.empty()) options_.iterate_upper_bound = &end_slice_;
    const FilesLease lease(files_);
    status_ = lease.status();
    if (!status_.ok()) return;
    rocksdb::ReadOptions ignoring = options_;
    ignoring.ignore_range_deletions = true;
    auto& of_all = TraitsOf(family).deletes_ranges ? witness_ : iterator_;
    of_all.reset(files_.db().NewIterator(ignoring, files_.handle(family)));
    files_.Register(this);
  }
  ~Cursor() { files_.Unregister(this); }
  Cursor(const Cursor&) = delete;
  Cursor& operator=(const Cursor&) = delete;

  // Copies the next entry; false at the end.
  Result<bool> Take(std::string* key, std::string* value) {
    VEDUTA_RETURN_IF_ERROR(status_);
    if (!started_) VEDUTA_RETURN_IF_ERROR(HearWitness());
    const FilesLease lease(files_);
    VEDUTA_RETURN_IF_ERROR(lease.status());
    if (!iterator_) iterator_.reset(files_.db().NewIterator(options_, files_.handle(family_)));
    // Not before somebody asks for the next entry: a step may read a whole photo.
    started_ ? iterator_->Next() : iterator_->Seek(begin_);
    started_ = true;
    if (!iterator_->Valid()) {
      VEDUTA_RETURN_IF_ERROR(Failure(*iterator_));
      return false;
    }
    key->assign(iterator_->key().data(), iterator_->key().size());
    value->assign(iterator_->value().data(), iterator_->value().size());
    return true;
  }

 private:
  void GiveBack() override {
    iterator_.reset();
    witness_.reset();
  }

  Status Failure(const rocksdb::Iterator& iterator) const {
    return FromRocksdb(iterator.status(), Doing(family_) + " from key " + KeyText(prefix_));
  }

  // Holds a lease for this many entries. Chosen by hand; not measured.
  static constexpr int kEntriesPerLease = 1000;

  Status HearWitness() {
    bool sought = false;
    for (bool at_end = false; !at_end;) {
      const FilesLease lease(files_);
      VEDUTA_RETURN_IF_ERROR(lease.status());
      if (!witness_) return Status::Ok();
      if (!std::exchange(sought, true)) witness_->Seek(begin_);
      for (int i = 0; i < kEntriesPerLease && witness_->Valid(); ++i) witness_->Next();
      at_end = !witness_->Valid();
      VEDUTA_RETURN_IF_ERROR(at_end ? Failure(*witness_) : Status::Ok());
    }
    return Status::Ok();
  }

  const DatabaseFiles& files_;
  const Family family_;
  const std::string prefix_;
  const std::string end_;
  const rocksdb::Slice end_slice_;
  const std::string begin_;
  rocksdb::ReadOptions options_;
  Status status_;
  bool started_ = false;
  std::unique_ptr<rocksdb::Iterator> iterator_, witness_;
};

}  // namespace

Status InValue(Family family, std::string_view key, const Status& status) {
  if (status.ok()) return status;
  return Status(status.code(), std::string("family ") + FamilyName(family) + ", key " +
                                   KeyText(key) + ": " + status.message());
}

ValueReader::ValueReader(const DatabaseFiles& files, const rocksdb::Snapshot* snapshot)
    : files_(files) {
  options_.snapshot = snapshot;
  options_.verify_checksums = true;
}

Result<bool> ValueReader::Read(Family family, std::string_view key, const Use& use) const {
  const FilesLease lease(files_);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  rocksdb::PinnableSlice value;
  const rocksdb::Status status =
      files_.db().Get(options_, files_.handle(family), AsSlice(key), &value);
  if (status.IsNotFound()) return false;
  VEDUTA_RETURN_IF_ERROR(InValue(family, key, FromRocksdb(status, Doing(family))));
  VEDUTA_RETURN_IF_ERROR(InValue(family, key, use(value.ToStringView())));
  return true;
}

Result<bool> ValueReader::Has(Family family, std::string_view key) const {
  return Read(family, key, [](std::string_view) { return Status::Ok(); });
}

Result<bool> ValueReader::Copy(Family family, std::string_view key, std::string* value) const {
  const FilesLease lease(files_);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  // RocksDB reads right into the string where the value is not in its cache.
  const rocksdb::Status status =
      files_.db().Get(options_, files_.handle(family), AsSlice(key), value);
  if (status.IsNotFound()) return false;
  VEDUTA_RETURN_IF_ERROR(InValue(family, key, FromRocksdb(status, Doing(family))));
  return true;
}

Status ValueReader::ReadMany(Family family, const std::vector<std::string>& keys,
                             const UseOne& use) const {
  const FilesLease lease(files_);
  VEDUTA_RETURN_IF_ERROR(lease.status());
  const std::vector<rocksdb::Slice> slices(keys.begin(), keys.end());
  std::vector<rocksdb::Status> statuses(keys.size());
  std::vector<rocksdb::PinnableSlice> values(keys.size());
  files_.db().MultiGet(options_, files_.handle(family), keys.size(), slices.data(), values.data(),
                       statuses.data(),
                       /*sorted_input=*/true);
  for (size_t i = 0; i < keys.size(); ++i) {
    if (!statuses[i].IsNotFound())
      VEDUTA_RETURN_IF_ERROR(InValue(family, keys[i], FromRocksdb(statuses[i], Doing(family))));
    VEDUTA_RETURN_IF_ERROR(InValue(family, keys[i], use(i, values[i].ToStringView())));
  }
  return Status::Ok();
}

Status ValueReader::Scan(Family family, std::string_view prefix, std::string_view first,
                         const Visit& visit) const {
  Cursor cursor(files_, family, options_, prefix, first);
  std::string key, value;
  for (bool more = true; more;) {
    VEDUTA_ASSIGN_OR_RETURN(const bool found, cursor.Take(&key, &value));
    if (!found) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(InValue(family, key, visit(key, value, &more)));
  }
  return Status::Ok();
}

}  // namespace veduta
