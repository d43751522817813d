// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is done with a database's files as a whole: their sizes, a copy, compaction. Database says
// what each function does. While the files of a copy are linked or a family is compacted, the files
// are not closed: Database::Reopen waits. It does not wait while a copy is read.

#include <stop_token>
#include <string>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

Result<DatabaseSizes> SizesOf(const DatabaseFiles& files);
Result<DatabaseStatistics> StatisticsOf(const DatabaseFiles& files);
Status MakeCheckpoint(const DatabaseFiles& files, const std::string& path);
// Uses no more of `files` than where it lies and its file system.
Status CheckCheckpoint(const DatabaseFiles& files, const std::string& path,
                       const std::stop_token& stop);
Status CompactFiles(const DatabaseFiles& files);

}  // namespace veduta
