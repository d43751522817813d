// SPDX-License-Identifier: Apache-2.0
#pragma once
// Changes a database behind its back.

#include <gtest/gtest.h>
#include <rocksdb/db.h>
#include "storage/family_options.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace veduta {

// Does something to the database's files with RocksDB alone, as damage would.
inline void WithRocksdb(const std::string& path,
                        const std::function<void(rocksdb::DB&, rocksdb::ColumnFamilyHandle*)>& act,
                        Family family) {
  std::vector<std::string> names;
  ASSERT_TRUE(rocksdb::DB::ListColumnFamilies(rocksdb::DBOptions(), path, &names).ok());
  std::vector<rocksdb::ColumnFamilyDescriptor> descriptors;
  for (const std::string& name : names) {
    const std::optional<Family> known = FindFamily(name);
    descriptors.emplace_back(
        name, known ? FamilyOptions(*known, nullptr) : rocksdb::ColumnFamilyOptions());
  }
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* db = nullptr;
  const rocksdb::Status status =
      rocksdb::DB::Open(rocksdb::DBOptions(), path, descriptors, &handles, &db);
  ASSERT_TRUE(status.ok()) << status.ToString();
  const auto named = [&](auto* handle) { return handle->GetName() == FamilyName(family); };
  const auto found = std::ranges::find_if(handles, named);
  ASSERT_NE(found, handles.end()) << FamilyName(family);
  act(*db, *found);
  for (auto* handle : handles) db->DestroyColumnFamilyHandle(handle);
  delete db;
}

}  // namespace veduta
