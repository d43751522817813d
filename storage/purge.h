// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rids the files of what was deleted. RocksDB leaves it in its log, in tables and in blob files
// until it has another reason to rewrite them; blob files of families that are `written_once`
// would never be rewritten.

#include <chrono>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

// Database::PurgeDeleted. Flushes all families, so that RocksDB deletes their log; compacts their
// tables, which drops deleted keys and counts what they leave in blob files; then rewrites blob
// files, from the oldest to the youngest that has something deleted in it: younger ones are spared.
// Deletes the folder set-aside, too, whose logs nobody can rewrite. Killed at any time, it may
// begin again. Snapshots and transactions from before the call are waited for; kBusy, and nothing
// is rewritten, where one of them is held for longer.
Status PurgeDeletedFrom(const DatabaseFiles& files, std::chrono::milliseconds wait);

// Chosen by hand; not measured.
inline constexpr std::chrono::seconds kPurgeWait{10};

}  // namespace veduta
