// SPDX-License-Identifier: Apache-2.0
#pragma once
// A Snapshot's side of what is hidden, reported and used up, over RocksDB.

#include <memory>
#include <span>

#include "storage/database_files.h"
#include "storage/moderation.h"
#include "storage/value_reader.h"

namespace veduta {

// Reads by `reader`, which outlives it.
std::unique_ptr<const ModerationReader> MakeModerationReader(const ValueReader& reader);

// Database::PutTokenUse.
Status PutTokenUse(DatabaseFiles& files, std::span<const TokenUse> uses);

}  // namespace veduta
