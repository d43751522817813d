// SPDX-License-Identifier: Apache-2.0
#include "storage/write_buffer.h"

#include "storage/records/key_bytes.h"
#include "storage/records/vocabulary_record.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

rocksdb::Slice AsSlice(std::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

void WriteBuffer::Note(const Status& status) {
  if (status_.ok()) status_ = status;
}

template <typename Add>
void WriteBuffer::Collect(Family family, Add&& add) {
  const FilesLease lease(files_);
  Note(lease.status());
  if (!lease.status().ok()) return;
  const rocksdb::Status added = add(files_.handle(family));
  if (!added.ok()) Note(FromRocksdb(added, "collect writes"));
}

void WriteBuffer::Put(Family family, std::string_view key, std::string_view value) {
  Collect(family, [&](auto* handle) { return batch_.Put(handle, AsSlice(key), AsSlice(value)); });
}

void WriteBuffer::Put(Family family, std::string_view key, const Result<std::string>& value) {
  if (!value.ok()) return NoteNotEncoded(family, key, value.status());
  Put(family, key, std::string_view(*value));
}

void WriteBuffer::Merge(Family family, std::string_view key, std::string_view operand) {
  Collect(family,
          [&](auto* handle) { return batch_.Merge(handle, AsSlice(key), AsSlice(operand)); });
}

void WriteBuffer::Merge(Family family, std::string_view key, const Result<std::string>& operand) {
  if (!operand.ok()) return NoteNotEncoded(family, key, operand.status());
  Merge(family, key, std::string_view(*operand));
}

void WriteBuffer::NoteNotEncoded(Family family, std::string_view key, const Status& failure) {
  Note(Status(failure.code(), std::string("a record cannot be stored in family ") +
                                  FamilyName(family) + ", key " + KeyText(key) + ": " +
                                  failure.message()));
}

void WriteBuffer::Delete(Family family, std::string_view key) {
  Collect(family, [&](auto* handle) { return batch_.Delete(handle, AsSlice(key)); });
}

void WriteBuffer::DeletePrefix(Family family, std::string_view prefix) {
  const std::string end = PrefixEnd(prefix);
  Collect(family,
          [&](auto* handle) { return batch_.DeleteRange(handle, AsSlice(prefix), AsSlice(end)); });
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
