// SPDX-License-Identifier: Apache-2.0
#pragma once
// How many records there are of each kind, as the state record keeps them.

#include <map>
#include <optional>
#include <set>

#include "storage/base/status.h"
#include "storage/model/state.h"
#include "storage/snapshot.h"

namespace veduta {

// Counts by reading every image and every camera. For a database whose state record has no counts,
// and for checking those that it has.
Result<DatabaseCounts> CountRecords(const Snapshot& snapshot);

// What one transaction changes in the counts. It compares each record with the one that it
// replaces: that of an earlier Put in the same transaction, or that of the base snapshot.
// Not thread-safe.
class CountChanges final {
 public:
  Status NotePut(const Snapshot& base, const ImageRecord& image);
  Status NotePut(const Snapshot& base, const CameraRecord& camera);
  Status NoteRemoval(const Snapshot& base, ImageId image);
  bool empty() const;

  // The counts after the transaction. None where those before it are not known, or where they
  // cannot be right: then they are counted again when the database is next opened for writing.
  std::optional<DatabaseCounts> ApplyTo(const std::optional<DatabaseCounts>& base) const;

 private:
  // What of an image is counted.
  struct Counted {
    Verdict verdict = Verdict::kRejected;
    bool is_located = false;
    bool operator==(const Counted&) const = default;
  };
  struct Change {
    std::optional<Counted> before, after;
  };
  Status Note(const Snapshot& base, ImageId id, std::optional<Counted> after);

  std::map<ImageId, Change> images_;
  std::set<CameraId> new_cameras_;
};

}  // namespace veduta
