// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a backup consists of: a text file, which also says of each file how to know it again in the
// database, so that the next backup need not read it. FORMAT.md has its grammar.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/status.h"

namespace veduta {

struct BackedUpFile {
  std::string name;  // in the folder of the database
  ContentHash hash;  // of its bytes
  uint64_t size_bytes = 0;
  // Of the database's file when it was copied: with name and size they stand for these bytes, since
  // RocksDB never writes into a table or a blob file again.
  uint64_t inode = 0;
  int64_t modified_ns = 0;  // since 1970
};

struct BackupManifest {
  uint32_t number = 0;  // from 1, ascending
  int64_t time_unix_s = 0;
  std::string database;             // the absolute path of its folder
  std::vector<BackedUpFile> files;  // ascending names

  uint64_t SizeBytes() const;
};

// The text ends with a hash of all that stands before.
std::string ManifestText(const BackupManifest& manifest);
// kCorruption for anything that ManifestText has not made; of names only plain ones are taken.
Result<BackupManifest> ParseManifest(std::string_view text);

}  // namespace veduta
