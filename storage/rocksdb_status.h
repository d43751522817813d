// SPDX-License-Identifier: Apache-2.0
#pragma once
// RocksDB's failures in our words.

#include <rocksdb/status.h>

#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// `doing` completes "cannot ...", as in "commit the transaction". A full disk is named as such; OK
// stays OK.
Status FromRocksdb(const rocksdb::Status& status, std::string_view doing);

}  // namespace veduta
