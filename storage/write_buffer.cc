// SPDX-License-Identifier: Apache-2.0
#include "storage/write_buffer.h"

#include "storage/keys.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

rocksdb::Slice AsSlice(std::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

void WriteBuffer::Fail(Status status) {
  if (status_.ok()) status_ = std::move(status);
}

void WriteBuffer::Note(const rocksdb::Status& status) {
  if (!status.ok()) Fail(FromRocksdb(status, "collect writes"));
}

void WriteBuffer::Put(Family family, std::string_view key, std::string_view value) {
  Note(batch_.Put(files_.handle(family), AsSlice(key), AsSlice(value)));
}

void WriteBuffer::Put(Family family, std::string_view key, const Result<std::string>& value) {
  if (value.ok()) {
    Put(family, key, std::string_view(*value));
    return;
  }
  Fail(Status(value.status().code(), std::string("a record cannot be stored in family ") +
                                         FamilyName(family) + ", key " + KeyText(key) + ": " +
                                         value.status().message()));
}

void WriteBuffer::Merge(Family family, std::string_view key, std::string_view operand) {
  Note(batch_.Merge(files_.handle(family), AsSlice(key), AsSlice(operand)));
}

void WriteBuffer::Delete(Family family, std::string_view key) {
  Note(batch_.Delete(files_.handle(family), AsSlice(key)));
}

void WriteBuffer::DeletePrefix(Family family, std::string_view prefix) {
  Note(batch_.DeleteRange(files_.handle(family), AsSlice(prefix), PrefixEnd(prefix)));
}

void WriteBuffer::DeleteVocabulary(uint32_t generation) {
  const std::string prefix = VocabularyKey(generation);
  Delete(Family::kVocabulary, prefix);
  DeletePrefix(Family::kWords, prefix);
  DeletePrefix(Family::kPostings, prefix);
}

Status WriteBuffer::Write(bool sync, std::string_view doing) {
  VEDUTA_RETURN_IF_ERROR(status_);
  if (empty()) return Status::Ok();
  return files_.Write(&batch_, sync, doing);
}

}  // namespace veduta
