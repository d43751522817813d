// SPDX-License-Identifier: Apache-2.0
#pragma once
// How photos go out again, and what people forbid. Standard library and plain structs only.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

struct RemoveRequest {
  std::vector<std::string> photos;  // each by its name, or by "#" and its number; or
  std::string contributor;          // all photos of this contributor
  std::string actor = "anonymous";  // who has them removed; for the journal
  std::string why;                  // for the journal

  Status Check() const;  // the first violated bound, named with its value
};

// One photo that is gone. Nothing stored has its name or its bytes any more.
struct RemovedPhoto {
  ImageId image;
  std::string name;
  ReconstructionId reconstruction;  // valid if it had a pose
  uint64_t observations = 0;        // of points, by its features
  // Photos that stood on it too much: they lost their pose, and Settle tries them again.
  std::vector<ImageId> unplaced;
  bool was_dense = false;  // depth maps or parts of a surface went with it: Densify makes them anew
};

struct RemoveAnswer {
  std::vector<RemovedPhoto> removed;  // in the order of the request
  // Ok: no file of the database has a byte of theirs any more. Otherwise why some may have, which a
  // later Remove or Settle mends: somebody still reads an earlier state, the disk is full.
  Status purged;
  // Copies that were made of this database and that nothing was removed from: of backups the
  // folders that the journal names, of repairs those that lie beside the database.
  std::vector<std::string> copies;
};

enum class ForbidKind : uint8_t { kPair, kMerge };

// Two photos that do not show the same place, or two reconstructions that must not be merged.
struct ForbidRequest {
  ForbidKind kind = ForbidKind::kPair;
  std::string a, b;                 // photos by name or "#" and number; reconstructions by number
  std::string actor = "anonymous";  // who says so
  std::string reason;               // for people
};

struct ForbiddenAnswer {
  ForbidKind kind = ForbidKind::kPair;
  ImageId image_a, image_b;                             // kPair, a < b
  std::string name_a, name_b;                           // kPair: of the photos
  ReconstructionId reconstruction_a, reconstruction_b;  // kMerge, a < b
  int64_t time_unix_s = 0;
  std::string actor, reason;
};

}  // namespace veduta
