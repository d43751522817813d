// SPDX-License-Identifier: Apache-2.0
#include "storage/rocksdb_status.h"

#include <string>

namespace veduta {

Status FromRocksdb(const rocksdb::Status& status, std::string_view doing) {
  if (status.ok()) return Status::Ok();
  const std::string words = status.ToString();
  const std::string message = "cannot " + std::string(doing) + ": " + words;
  // Some paths inside RocksDB lose the subcode and keep the operating system's words only.
  const bool disk_full =
      status.IsNoSpace() || words.find("No space left on device") != std::string::npos;
  if (disk_full) {
    return Status::IoError("the disk is full: free some space, then open the database again (" +
                           message + ")");
  }
  // RocksDB 7.8 opens CURRENT or the manifest once more where the first attempt fails, and takes
  // the second one's success for the lack of direct I/O, which we never ask for.
  if (words.find("Direct I/O is not supported by the specified DB") != std::string::npos) {
    return Status::IoError("cannot " + std::string(doing) +
                           ": a file could not be read, and then could: try again");
  }
  // RocksDB 7.8 calls damaged what it could not list or look at just now.
  const bool is_unread = words.find("Can't list files in") != std::string::npos ||
                         words.find("Can't access ") != std::string::npos;
  const bool is_missing = words.find("No such file") != std::string::npos;
  if (is_unread && !is_missing && words.find("IO error") != std::string::npos)
    return Status::IoError(message);
  switch (status.code()) {
    case rocksdb::Status::kNotFound:
      return Status::NotFound(message);
    case rocksdb::Status::kCorruption:
    case rocksdb::Status::kColumnFamilyDropped:
    case rocksdb::Status::kCompactionTooLarge:
      return Status::Corruption(message);
    case rocksdb::Status::kNotSupported:
    case rocksdb::Status::kInvalidArgument:
      return Status::InvalidArgument(message);
    case rocksdb::Status::kBusy:
    case rocksdb::Status::kTryAgain:
    case rocksdb::Status::kTimedOut:
    case rocksdb::Status::kMergeInProgress:
      return Status::Busy(message);
    default:
      return Status::IoError(message);
  }
}

}  // namespace veduta
