// SPDX-License-Identifier: Apache-2.0
#pragma once
// Damages a closed city, and has it repaired.

#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {

inline void Overwrite(const City& city, Family family, const std::string& key,
                      const std::string& value) {
  WithRocksdb(
      city.path(),
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Put({}, handle, key, value).ok());
      },
      family);
}

// Opens the city again, which must be sound.
inline RepairAnswer Repair(City* city) {
  RepairRequest request;
  request.apply = true;
  request.thread_count = 2;
  const auto answer = Engine::Repair(city->path(), request);
  EXPECT_OK(answer);
  city->Open();
  EXPECT_TRUE(IsSound(city->Ask().snapshot()));
  return answer.ok() ? *answer : RepairAnswer();
}

}  // namespace veduta
