// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file that was made or renamed outlives a power cut only when its folder is synced.

#include <rocksdb/file_system.h>

#include <string>

#include "storage/base/status.h"

namespace veduta {

// Syncs the entries of `folder`, not what its files hold. kIoError.
Status MakeFolderDurable(rocksdb::FileSystem& file_system, const std::string& folder);

}  // namespace veduta
