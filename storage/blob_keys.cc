// SPDX-License-Identifier: Apache-2.0
#include "storage/blob_keys.h"

#include <rocksdb/utilities/debug.h>

#include <limits>
#include <string>
#include <vector>

#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// RocksDB's numbers of value types, which its files hold and which therefore stay.
constexpr int kTypeValue = 0x1;
constexpr int kTypeBlobIndex = 0x11;

constexpr size_t kVersionsPerPage = 32;  // some are whole photos

}  // namespace

Status ScanBlobKeys(const DatabaseFiles& files, Family family, const rocksdb::Snapshot* snapshot,
                    const std::function<Result<bool>(std::string_view key)>& visit) {
  const rocksdb::SequenceNumber newest = snapshot != nullptr
                                             ? snapshot->GetSequenceNumber()
                                             : std::numeric_limits<rocksdb::SequenceNumber>::max();
  const std::string end(64, '\xFF');
  std::string begin;
  size_t page = kVersionsPerPage;
  for (;;) {
    std::vector<rocksdb::KeyVersion> versions;
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(
        rocksdb::GetAllKeyVersions(&files.db(), files.handle(family), begin, end, page, &versions),
        std::string("list family ") + FamilyName(family)));
    const bool last_page = versions.size() < page;
    if (!last_page && versions.front().user_key == versions.back().user_key) {
      page *= 2;  // one key has more versions than a page holds
      continue;
    }
    size_t i = 0;
    while (i < versions.size()) {
      const std::string& key = versions[i].user_key;
      // The last key of a page that is not the last may have versions on the next one: it begins
      // that.
      if (!last_page && key == versions.back().user_key) break;
      size_t past = i;
      int type = -1;
      for (; past < versions.size() && versions[past].user_key == key; ++past) {
        if (type < 0 && versions[past].sequence <= newest)
          type = versions[past].type;  // newest first
      }
      if (type == kTypeValue || type == kTypeBlobIndex) {
        VEDUTA_ASSIGN_OR_RETURN(const bool more, visit(key));
        if (!more) return Status::Ok();
      }
      i = past;
    }
    if (last_page) return Status::Ok();
    begin = versions.back().user_key;
    page = kVersionsPerPage;
  }
}

}  // namespace veduta
