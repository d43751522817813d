// SPDX-License-Identifier: Apache-2.0
#pragma once
// A database whose keys and values a test changes as they lie, and puts back.

#include <gtest/gtest.h>
#include <rocksdb/db.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/database_files.h"
#include "storage/snapshot_view.h"
#include "tests/storage/samples.h"

namespace veduta {

class StoredFamilies final {
 public:
  explicit StoredFamilies(const std::string& path) {
    auto opened = DatabaseFiles::Open(path, DatabaseOptions());
    EXPECT_OK(opened);
    if (opened.ok()) files_ = std::move(*opened);
  }

  std::shared_ptr<const Snapshot> GetSnapshot() const { return MakeSnapshot(files_); }

  // Ascending.
  std::vector<std::string> Keys(Family family) const {
    std::vector<std::string> keys;
    const std::unique_ptr<rocksdb::Iterator> it(
        files_->db().NewIterator(rocksdb::ReadOptions(), files_->handle(family)));
    for (it->SeekToFirst(); it->Valid(); it->Next()) keys.push_back(it->key().ToString());
    return keys;
  }
  std::optional<std::string> Get(Family family, const std::string& key) const {
    std::string value;
    const auto status =
        files_->db().Get(rocksdb::ReadOptions(), files_->handle(family), key, &value);
    return status.ok() ? std::optional(value) : std::nullopt;
  }
  void Put(Family family, const std::string& key, const std::string& value) {
    Remember(family, key);
    Write(family, key, value);
  }
  void Delete(Family family, const std::string& key) {
    Remember(family, key);
    Write(family, key, std::nullopt);
  }
  // Undoes all Puts and Deletes since the last call.
  void PutBack() {
    for (const auto& [place, value] : before_) Write(place.first, place.second, value);
    before_.clear();
  }

 private:
  void Remember(Family family, const std::string& key) {
    before_.try_emplace({family, key}, Get(family, key));
  }
  void Write(Family family, const std::string& key, const std::optional<std::string>& value) {
    rocksdb::WriteOptions options;
    options.disableWAL = true;
    const auto handle = files_->handle(family);
    const rocksdb::Status status = value ? files_->db().Put(options, handle, key, *value)
                                         : files_->db().Delete(options, handle, key);
    EXPECT_TRUE(status.ok()) << status.ToString();
  }

  std::shared_ptr<DatabaseFiles> files_;
  std::map<std::pair<Family, std::string>, std::optional<std::string>> before_;
};

}  // namespace veduta
