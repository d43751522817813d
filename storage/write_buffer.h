// SPDX-License-Identifier: Apache-2.0
#pragma once
// A batch of writes over several families that keeps the first failure to itself until it is
// written.

#include <rocksdb/write_batch.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/database_files.h"

namespace veduta {

// Not thread-safe. After the files have been closed (Database::Reopen), all that is added is
// refused with their reason.
class WriteBuffer final {
 public:
  explicit WriteBuffer(DatabaseFiles& files) : files_(files) {}

  void Put(Family family, std::string_view key, std::string_view value);
  // The encoder's result as it is: its failure is this buffer's, naming family and key.
  void Put(Family family, std::string_view key, const Result<std::string>& value);
  void Merge(Family family, std::string_view key, std::string_view operand);
  void Merge(Family family, std::string_view key, const Result<std::string>& operand);  // as Put
  void Delete(Family family, std::string_view key);
  void DeletePrefix(Family family, std::string_view prefix);
  void DeleteVocabulary(uint32_t generation);
  // Makes a failure this buffer's; nothing where `status` is Ok.
  void Note(const Status& status);

  const Status& status() const { return status_; }
  size_t size_bytes() const { return batch_.GetDataSize(); }
  bool empty() const { return batch_.Count() == 0; }
  rocksdb::WriteBatch* batch() { return &batch_; }

  // Applies all of it, or nothing; nothing either when a Put failed. Not for commits, which go by
  // DatabaseFiles::Commit.
  Status Write(bool sync, std::string_view doing);

 private:
  // Makes the encoder's failure this buffer's, naming family and key.
  void NoteNotEncoded(Family family, std::string_view key, const Status& failure);

  // Calls add(handle) -> rocksdb::Status with the family's handle, while the files are open.
  template <typename Add>
  void Collect(Family family, Add&& add);

  DatabaseFiles& files_;
  rocksdb::WriteBatch batch_;
  Status status_;
};

}  // namespace veduta
