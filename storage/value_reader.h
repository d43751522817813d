// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads values of a family at one moment, with failures that name family and key.

#include <rocksdb/options.h>
#include <rocksdb/slice.h>

#include <functional>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

// `status`, with family and key put before its message.
Status InValue(Family family, std::string_view key, const Status& status);

// Thread-safe. Borrows the files and the snapshot (null: whatever is newest at each call).
class ValueReader final {
 public:
  ValueReader(const DatabaseFiles& files, const rocksdb::Snapshot* snapshot);

  // Whether the key is there; its value then.
  Result<bool> Find(Family family, std::string_view key, rocksdb::PinnableSlice* value) const;

  // Calls visit(key, value, &more) on every key that starts with `prefix` and is not below `first`,
  // ascending, until it clears `more`. A failure of visit ends the scan and is returned with family
  // and key.
  using Visit = std::function<Status(std::string_view key, std::string_view value, bool* more)>;
  Status Scan(Family family, std::string_view prefix, std::string_view first,
              const Visit& visit) const;

  // As Find for many keys, which ascend; values of keys that are not there are empty.
  Status FindMany(Family family, const std::vector<std::string>& keys,
                  std::vector<rocksdb::PinnableSlice>* values) const;

 private:
  const DatabaseFiles& files_;
  rocksdb::ReadOptions options_;
};

}  // namespace veduta
