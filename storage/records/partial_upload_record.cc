// SPDX-License-Identifier: Apache-2.0
#include "storage/records/partial_upload_record.h"

#include <algorithm>

#include "storage/records/contribution_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"
#include "storage/records/upload_record.h"

namespace veduta {
namespace {

std::string_view AsBytes(const PartialUploadId& id) {
  return {reinterpret_cast<const char*>(id.data()), id.size()};
}

uint8_t TagOf(bool has_arrived) {
  return static_cast<uint8_t>(has_arrived ? ContributionEntry::kArrived
                                          : ContributionEntry::kPartial);
}

// Takes the entry's byte and the id off the key.
Status TakeId(std::string_view* key, PartialUploadId* id) {
  if (key->size() < 1 + id->size()) return Status::Corruption("a key of wrong length");
  std::copy_n(key->begin() + 1, id->size(), id->begin());
  key->remove_prefix(1 + id->size());
  return Status::Ok();
}

}  // namespace

std::string PartialUploadKey(const PartialUploadId& id, bool has_arrived) {
  return TaggedKey(TagOf(has_arrived), AsBytes(id));
}

std::string PartialUploadPrefix(bool has_arrived) {
  return TaggedKey(TagOf(has_arrived), "");
}

std::string PieceKey(const PartialUploadId& id, uint32_t number) {
  std::string rest(AsBytes(id));
  AppendBigEndian32(&rest, number);
  return TaggedKey(static_cast<uint8_t>(UploadEntry::kPiece), rest);
}

Status ParsePartialUploadKey(std::string_view key, PartialUploadId* id) {
  if (!key.starts_with(PartialUploadPrefix(false)) && !key.starts_with(PartialUploadPrefix(true)))
    return Status::Corruption("no key of an upload in parts");
  VEDUTA_RETURN_IF_ERROR(TakeId(&key, id));
  return key.empty() ? Status::Ok() : Status::Corruption("a key of wrong length");
}

Status ParsePieceKey(std::string_view key, PartialUploadId* id, uint32_t* number) {
  if (!key.starts_with(TaggedKey(static_cast<uint8_t>(UploadEntry::kPiece), "")))
    return Status::Corruption("no key of a piece");
  VEDUTA_RETURN_IF_ERROR(TakeId(&key, id));
  if (TakeBigEndian32(&key, number) && key.empty()) return Status::Ok();
  return Status::Corruption("a key of wrong length");
}

Status Check(const PartialUploadRecord& partial) {
  const uint64_t received = partial.received_bytes;
  if (partial.length_bytes == 0) return Broken("length", 0, "1 or more");
  if (received > partial.length_bytes)
    return Broken("received bytes", received, "at most the length");
  if ((partial.upload != 0) != (received == partial.length_bytes))
    return Broken("number in line", partial.upload, "there once all bytes have come");
  const bool has_pieces = received > 0 && partial.upload == 0;
  if ((partial.piece_count > 0) != has_pieces || partial.piece_count > received)
    return Broken("number of pieces", partial.piece_count, "one that holds the received bytes");
  if ((partial.last_piece_bytes > 0) != has_pieces || partial.last_piece_bytes > received)
    return Broken("bytes of the last piece", partial.last_piece_bytes, "some of those received");
  return Status::Ok();
}

Result<std::string> Encode(const PartialUploadRecord& partial) {
  VEDUTA_RETURN_IF_ERROR(Check(partial));
  const size_t payload = partial.name.size() + partial.contributor.size() + partial.camera.size();
  return WriteMessage<schema::PartialUpload>(payload, [&](auto to) {
    to.setName(AsText(partial.name));
    to.setContributor(AsText(partial.contributor));
    to.setCamera(AsText(partial.camera));
    to.setContribution(partial.contribution);
    to.setToken(partial.token);
    to.setLengthBytes(partial.length_bytes);
    to.setReceivedBytes(partial.received_bytes);
    to.setPieceCount(partial.piece_count);
    to.setLastPieceBytes(partial.last_piece_bytes);
    to.setBegunUnixS(partial.begun_unix_s);
    to.setTouchedUnixS(partial.touched_unix_s);
    to.setUpload(partial.upload);
  });
}

Status Decode(std::string_view value, PartialUploadRecord* partial) {
  return ReadMessage<schema::PartialUpload>(value, [&](schema::PartialUpload::Reader from) {
    partial->name = FromText(from.getName());
    partial->contributor = FromText(from.getContributor());
    partial->camera = FromText(from.getCamera());
    partial->contribution = from.getContribution();
    partial->token = from.getToken();
    partial->length_bytes = from.getLengthBytes();
    partial->received_bytes = from.getReceivedBytes();
    partial->piece_count = from.getPieceCount();
    partial->last_piece_bytes = from.getLastPieceBytes();
    partial->begun_unix_s = from.getBegunUnixS();
    partial->touched_unix_s = from.getTouchedUnixS();
    partial->upload = from.getUpload();
    return Damaged(Check(*partial));
  });
}

}  // namespace veduta
