// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads what can be read of a damaged database. It never writes to the database's folder: it works
// in a folder of links beside it.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/blob_search.h"
#include "storage/database.h"

namespace veduta {

enum class OpenTrouble : uint8_t;  // storage/database_opener.h

class DatabaseFiles;

// Not thread-safe.
class Salvage final {
 public:
  // `scratch` is a folder on the same disk that must not exist. It is made, and it has to stay as
  // long as the Salvage lives; whoever asked for it deletes it. Where RocksDB does not open the
  // files, its own repair is tried on the links; where that fails too, an empty database stands in
  // for them and only GetPhoto and ScanStrayPhotos find anything. kNotFound where there is no
  // folder of a database; kInvalidArgument for a database of another format; kIoError where the
  // scratch folder cannot be made.
  static Result<std::unique_ptr<Salvage>> Open(const std::string& path, const std::string& scratch,
                                               const DatabaseOptions& options);
  ~Salvage();

  // What was wrong with the files as a whole, one sentence each.
  const std::vector<std::string>& damage() const { return damage_; }
  // The files had to be put together anew: what is missing may have been lost without a trace.
  bool is_pieced_together() const { return is_pieced_together_; }
  // Commits may be missing whose photos, which were written before them, are there.
  bool may_miss_commits() const { return log_was_damaged_ || is_pieced_together_; }
  const Snapshot& snapshot() const { return *snapshot_; }
  // The number of its format; 0 where it cannot be read.
  uint32_t format() const { return format_; }

  // The photo's bytes, which have this hash; from wherever they are found. `size_bytes` says how
  // many there are; 0: not known, and then fewer damages are got round.
  Result<std::vector<uint8_t>> GetPhoto(const ContentHash& photo, uint64_t size_bytes = 0) const;
  // The photos in blob files, whether or not any record knows them. Reads all of them.
  void ScanStrayPhotos(const std::function<bool(const ContentHash&)>& visit) const;
  // Every entry of `names` and of `hashes` up to the first that cannot be read. The contributor is
  // empty where the database has a format before 3, which does not tell it there.
  Status ScanNames(const std::function<void(const PhotoName&, ImageId image)>& visit) const;
  Status ScanHashes(const std::function<void(const ContentHash&, ImageId image)>& visit) const;

 private:
  Salvage(std::string path, std::string scratch, const DatabaseOptions& options);
  Status OpenScratch();
  Status RefuseOtherFormat(const Status& opened);
  Status PieceTogether();
  Status StandIn();
  const BlobSearch& blobs() const;

  const std::string path_, scratch_;
  DatabaseOptions options_;
  std::vector<std::string> damage_;
  uint32_t format_ = 0;
  OpenTrouble trouble_{};  // of the last OpenScratch
  bool log_was_damaged_ = false, is_pieced_together_ = false;
  std::shared_ptr<DatabaseFiles> files_;
  std::shared_ptr<const Snapshot> snapshot_;
  mutable std::optional<BlobSearch> blobs_;
};

}  // namespace veduta
