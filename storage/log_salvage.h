// SPDX-License-Identifier: Apache-2.0
#pragma once
// Brings back what can be read of a damaged write-ahead log.

#include <string>

#include "storage/base/status.h"
#include "storage/database_options.h"
#include "storage/log_inspection.h"

namespace veduta {

// In the database's folder: the damaged logs as they were found, in folders 1, 2, ...
inline constexpr const char* kSetAsideFolder = "set-aside";

// Makes a database whose log is damaged (InspectLogs says how) one that opens: keeps the unreadable
// logs and the file ACKNOWLEDGED in set-aside/, writes each such log anew from the records that can
// be read, and has RocksDB replay all of them. What is lost is lost as InspectLogs counts it; what
// comes after it may then name records that are lost, which is for the caller to mend. Where the
// log is whole, does nothing. May be called again after it was interrupted at any point.
// kBusy when another process has the database open; kIoError; kCorruption where more than the log
// is damaged.
Status SalvageLogs(const std::string& path, const DatabaseOptions& options);

}  // namespace veduta
