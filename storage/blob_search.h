// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds photos in blob files that no table leads to: after a loss of RocksDB's manifest or of a
// table. A photo's key is the hash of its bytes, so whatever is found proves itself.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/status.h"

namespace veduta {

// Where the records of all blob files of a folder lie whose keys may be those of photos. Reads the
// headers of the records only, and searches byte by byte where a header is damaged. The layout is
// that of RocksDB 7.8's db/blob/blob_log_format.h. Not thread-safe.
class BlobSearch final {
 public:
  // Files that cannot be read are passed over.
  explicit BlobSearch(const std::string& folder);

  // The bytes whose hash is `photo`, where they are anywhere whole. `size_bytes` is how many there
  // are, or 0 where that is not known: then a record with a damaged key or length is not found.
  std::optional<std::vector<uint8_t>> Find(const ContentHash& photo, uint64_t size_bytes) const;
  // Calls visit on the hash of every photo that is there whole, ascending, until it returns false.
  // Reads all of them.
  void Scan(const std::function<bool(const ContentHash&)>& visit) const;

 private:
  struct Place {
    size_t file = 0;  // index in paths_
    uint64_t offset = 0, size_bytes = 0;
  };
  void Index(size_t file);
  std::optional<std::vector<uint8_t>> Read(const Place& place, const ContentHash& photo) const;
  std::optional<std::vector<uint8_t>> FindInGap(const Place& gap, const ContentHash& photo,
                                                uint64_t size_bytes) const;

  std::vector<std::string> paths_;
  std::multimap<ContentHash, Place> places_;
  std::vector<Place> gaps_;  // what no header leads to
};

}  // namespace veduta
