// SPDX-License-Identifier: Apache-2.0
#pragma once
// The Snapshot over RocksDB.

#include <memory>

#include "storage/database_files.h"
#include "storage/snapshot.h"

namespace veduta {

// The files stay open as long as it lives.
std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<const DatabaseFiles> files);

}  // namespace veduta
