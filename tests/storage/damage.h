// SPDX-License-Identifier: Apache-2.0
#pragma once
// Changes a database behind its back.

#include <gtest/gtest.h>
#include <rocksdb/db.h>

#include <functional>
#include <string>
#include <vector>

#include "storage/families.h"

namespace veduta {

// Does something to the database's files with RocksDB alone, as damage would.
inline void WithRocksdb(const std::string& path,
                        const std::function<void(rocksdb::DB&, rocksdb::ColumnFamilyHandle*)>& act, Family family) {
  std::vector<rocksdb::ColumnFamilyDescriptor> descriptors = {{"default", {}}};
  for (size_t i = 0; i < kFamilyCount; ++i) {
    descriptors.emplace_back(FamilyName(static_cast<Family>(i)), FamilyOptions(static_cast<Family>(i), nullptr));
  }
  std::vector<rocksdb::ColumnFamilyHandle*> handles;
  rocksdb::DB* db = nullptr;
  const rocksdb::Status status = rocksdb::DB::Open(rocksdb::DBOptions(), path, descriptors, &handles, &db);
  ASSERT_TRUE(status.ok()) << status.ToString();
  act(*db, handles[1 + static_cast<size_t>(family)]);
  for (auto* handle : handles) db->DestroyColumnFamilyHandle(handle);
  delete db;
}

}  // namespace veduta
