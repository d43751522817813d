// SPDX-License-Identifier: Apache-2.0
#include "storage/value_reader.h"

#include <memory>

#include "storage/keys.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

rocksdb::Slice AsSlice(std::string_view text) {
  return {text.data(), text.size()};
}

std::string Doing(Family family) {
  return std::string("read family ") + FamilyName(family);
}

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

Result<bool> ValueReader::Find(Family family, std::string_view key,
                               rocksdb::PinnableSlice* value) const {
  const rocksdb::Status status =
      files_.db().Get(options_, files_.handle(family), AsSlice(key), value);
  if (status.ok()) return true;
  if (status.IsNotFound()) return false;
  return InValue(family, key, FromRocksdb(status, Doing(family)));
}

Status ValueReader::Scan(Family family, std::string_view prefix, std::string_view first,
                         const Visit& visit) const {
  const std::string end = prefix.empty() ? std::string() : PrefixEnd(prefix);
  const rocksdb::Slice end_slice(end);
  rocksdb::ReadOptions options = options_;
  if (!prefix.empty()) options.iterate_upper_bound = &end_slice;
  const std::unique_ptr<rocksdb::Iterator> it(
      files_.db().NewIterator(options, files_.handle(family)));
  bool more = true;
  for (it->Seek(AsSlice(std::max(prefix, first))); more && it->Valid(); it->Next()) {
    const std::string_view key = it->key().ToStringView();
    VEDUTA_RETURN_IF_ERROR(InValue(family, key, visit(key, it->value().ToStringView(), &more)));
  }
  if (!more) return Status::Ok();
  return FromRocksdb(it->status(), Doing(family) + " from key " + KeyText(prefix));
}

Status ValueReader::FindMany(Family family, const std::vector<std::string>& keys,
                             std::vector<rocksdb::PinnableSlice>* values) const {
  std::vector<rocksdb::Slice> slices(keys.begin(), keys.end());
  std::vector<rocksdb::Status> statuses(keys.size());
  *values = std::vector<rocksdb::PinnableSlice>(keys.size());
  files_.db().MultiGet(options_, files_.handle(family), keys.size(), slices.data(), values->data(),
                       statuses.data(),
                       /*sorted_input=*/true);
  for (size_t i = 0; i < keys.size(); ++i) {
    if (statuses[i].ok() || statuses[i].IsNotFound()) continue;
    return InValue(family, keys[i], FromRocksdb(statuses[i], Doing(family)));
  }
  return Status::Ok();
}

}  // namespace veduta
