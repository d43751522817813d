// SPDX-License-Identifier: Apache-2.0
#include "storage/records/upload_record.h"

#include <algorithm>
#include <cstring>

#include "storage/model/partial_upload.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

std::string EntryKey(UploadEntry entry, uint64_t number) {
  std::string rest;
  AppendBigEndian64(&rest, number);
  return TaggedKey(static_cast<uint8_t>(entry), rest);
}

}  // namespace

std::string UploadKey(uint64_t number) {
  return EntryKey(UploadEntry::kRecord, number);
}

std::string UploadBytesKey(uint64_t number) {
  return EntryKey(UploadEntry::kBytes, number);
}

std::string UploadPrefix() {
  return TaggedKey(static_cast<uint8_t>(UploadEntry::kRecord), "");
}

std::string LastUploadKey() {
  return TaggedKey(static_cast<uint8_t>(UploadEntry::kLastNumber), "");
}

Status ParseUploadKey(std::string_view key, UploadEntry* entry, uint64_t* number) {
  *number = 0;
  if (key.empty()) return Status::Corruption("an empty key");
  *entry = static_cast<UploadEntry>(key[0]);
  key.remove_prefix(1);
  switch (*entry) {
    case UploadEntry::kRecord:
    case UploadEntry::kBytes:
      if (TakeBigEndian64(&key, number) && key.empty() && *number != 0) return Status::Ok();
      return Status::Corruption("a key without an upload's number");
    case UploadEntry::kLastNumber:
      return key.empty() ? Status::Ok() : Status::Corruption("a key of wrong length");
    case UploadEntry::kPiece:
      return key.size() == sizeof(PartialUploadId) + sizeof(uint32_t)
                 ? Status::Ok()
                 : Status::Corruption("a key of wrong length");
    case UploadEntry::kOriginal:
      return key.size() == sizeof(uint32_t) ? Status::Ok()
                                            : Status::Corruption("a key of wrong length");
  }
  return Status::Corruption("a key of an unknown kind");
}

Status Check(const UploadRecord& upload) {
  if (upload.number == 0) return Broken("upload's number", 0, "1 or more");
  return Status::Ok();
}

Result<std::string> Encode(const UploadRecord& upload) {
  VEDUTA_RETURN_IF_ERROR(Check(upload));
  const size_t payload = upload.name.size() + upload.contributor.size() + upload.camera.size() + 32;
  return WriteMessage<schema::Upload>(payload, [&](auto to) {
    to.setName(AsText(upload.name));
    to.setContributor(AsText(upload.contributor));
    to.setCamera(AsText(upload.camera));
    to.setPhoto(AsData(upload.photo.bytes.data(), upload.photo.bytes.size()));
    to.setSizeBytes(upload.size_bytes);
    to.setTimeUnixS(upload.time_unix_s);
    to.setContribution(upload.contribution);
  });
}

Status Decode(std::string_view value, uint64_t number, UploadRecord* upload) {
  return ReadMessage<schema::Upload>(value, [&](schema::Upload::Reader from) {
    upload->number = number;
    upload->name = FromText(from.getName());
    upload->contributor = FromText(from.getContributor());
    upload->camera = FromText(from.getCamera());
    const capnp::Data::Reader photo = from.getPhoto();
    if (photo.size() != upload->photo.bytes.size()) return BadRows("photo");
    std::copy(photo.begin(), photo.end(), upload->photo.bytes.begin());
    upload->size_bytes = from.getSizeBytes();
    upload->time_unix_s = from.getTimeUnixS();
    upload->contribution = from.getContribution();
    return Damaged(Check(*upload));
  });
}

std::string EncodeLastUpload(uint64_t number) {
  return std::string(reinterpret_cast<const char*>(&number), sizeof(number));
}

Status DecodeLastUpload(std::string_view value, uint64_t* number) {
  if (value.size() != sizeof(*number))
    return Status::Corruption("a number of " + std::to_string(value.size()) + " bytes");
  std::memcpy(number, value.data(), sizeof(*number));
  return Status::Ok();
}

}  // namespace veduta
