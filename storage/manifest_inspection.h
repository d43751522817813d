// SPDX-License-Identifier: Apache-2.0
#pragma once
// Is the manifest whole? It is RocksDB's list of its files, as edits that follow on each other. An
// edit whose length is damaged looks to RocksDB like the torn end of the list: it takes an older
// list for the newest, opens, and deletes what that list does not name.

#include <optional>
#include <string>

#include "storage/acknowledged.h"
#include "storage/base/status.h"

namespace veduta {

// kCorruption, with what to do, where
//   - something unreadable in the manifest is not an end that a power cut may have torn,
//   - the manifest ends before what `mark` claims of it,
//   - CURRENT names an older manifest than `mark` does.
// Not noticed, and harmless unless the process was killed just then: the loss of the last edit,
// where it was written after the database was opened and a kill came before it was closed.
// Changes nothing; reads the manifest once. kNotFound, kIoError. A process that writes beside this
// may delete the manifest meanwhile: then look again. `mark` is to be read before this is called.
Status CheckManifest(const std::string& path, rocksdb::FileSystem& file_system,
                     const std::optional<AcknowledgedMark>& mark);

}  // namespace veduta
