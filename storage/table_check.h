// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether one of RocksDB's files that never change is what RocksDB has written, by its checksums.

#include <stop_token>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// Of a table (.sst) all blocks are read, of a blob file (.blob) all records; of other files there
// is nothing to check. kCorruption names the file and where; kIoError, kCancelled. The layout of
// blob files is that of RocksDB 7.8's db/blob/blob_log_format.h.
Status CheckStoredFile(const std::string& path, const std::stop_token& stop);

}  // namespace veduta
