// SPDX-License-Identifier: Apache-2.0
#pragma once
// How RocksDB keeps each family: the table of storage/records/families.h as its options.

#include <rocksdb/cache.h>
#include <rocksdb/options.h>

#include <memory>

#include "storage/records/families.h"

namespace veduta {

rocksdb::ColumnFamilyOptions FamilyOptions(Family family,
                                           const std::shared_ptr<rocksdb::Cache>& cache);
rocksdb::DBOptions DatabaseWideOptions();

}  // namespace veduta
