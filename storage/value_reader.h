// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads values of a family at one moment, with failures that name family and key.

#include <rocksdb/options.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

// `status`, with family and key put before its message.
Status InValue(Family family, std::string_view key, const Status& status);

// Thread-safe. Borrows the files and the snapshot (null: whatever is newest at each call).
//
// Each read, and each step of a scan, holds a lease of the files of its own: where the database is
// opened again meanwhile, a scan ends at the next entry with the lease's failure.
class ValueReader final {
 public:
  ValueReader(const DatabaseFiles& files, const rocksdb::Snapshot* snapshot);

  Result<bool> Has(Family family, std::string_view key) const;
  // Whether the key is there; a copy of its value then.
  Result<bool> Copy(Family family, std::string_view key, std::string* value) const;

  // Calls use(value) where the key is there, and says whether it is. The value lies in RocksDB's
  // memory, and the lease is held meanwhile: `use` decodes, and does nothing else. Its failure is
  // returned with family and key.
  using Use = std::function<Status(std::string_view value)>;
  Result<bool> Read(Family family, std::string_view key, const Use& use) const;

  // As Read for many keys, which ascend: calls use(i, value) for each key i, in order; the value of
  // a key that is not there is empty.
  using UseOne = std::function<Status(size_t i, std::string_view value)>;
  Status ReadMany(Family family, const std::vector<std::string>& keys, const UseOne& use) const;

  // Calls visit(key, value, &more) on every key that starts with `prefix` and is not below `first`,
  // ascending, until it clears `more`. No lease is held meanwhile: visit may take its time, and
  // read. A failure of visit ends the scan and is returned with family and key.
  using Visit = std::function<Status(std::string_view key, std::string_view value, bool* more)>;
  Status Scan(Family family, std::string_view prefix, std::string_view first,
              const Visit& visit) const;

 private:
  const DatabaseFiles& files_;
  rocksdb::ReadOptions options_;
};

}  // namespace veduta
