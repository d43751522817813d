// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a PinnedBytes holds.

#include <rocksdb/slice.h>

#include <memory>

#include "storage/database_files.h"

namespace veduta {

struct PinnedBytes::Impl {
  std::shared_ptr<const DatabaseFiles> files;  // outlives the value, whose block it owns
  rocksdb::PinnableSlice value;
};

}  // namespace veduta
