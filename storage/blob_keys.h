// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lists the keys of a family of large values without reading the values: an ordinary iterator would
// fetch every blob.

#include <cstdint>
#include <functional>
#include <string_view>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

// Calls visit(key) -> whether to go on, ascending, on the keys that were there at the sequence
// number `newest`, of a snapshot that is still held. Values that are in memory are copied in small
// groups; no lease of the files is held during visit. Where the family deletes ranges of keys,
// visit may get keys that are gone, and not those that a later range has deleted.
// kCorruption where a table of the family cannot be read, before any visit: reads all of them.
Status ScanBlobKeys(const DatabaseFiles& files, Family family, uint64_t newest,
                    const std::function<Result<bool>(std::string_view key)>& visit);

}  // namespace veduta
