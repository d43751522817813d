// SPDX-License-Identifier: Apache-2.0
#pragma once
// A Snapshot's side of uploads in parts and of contributions, over RocksDB.

#include <memory>

#include "storage/contributing.h"
#include "storage/value_reader.h"

namespace veduta {

// Reads by `reader`, which outlives it.
std::unique_ptr<const ContributingReader> MakeContributingReader(const ValueReader& reader);

}  // namespace veduta
