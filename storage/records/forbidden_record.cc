// SPDX-License-Identifier: Apache-2.0
#include "storage/records/forbidden_record.h"

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string ForbiddenKey(ForbiddenKind kind, uint32_t smaller, uint32_t larger) {
  return std::string(kForbiddenPrefix) +
         TaggedKey(static_cast<uint8_t>(kind), Key32x2(smaller, larger));
}

Status ParseForbiddenKey(std::string_view key, ForbiddenRecord* record) {
  if (!key.starts_with(kForbiddenPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kForbiddenPrefix.size());
  if (key.empty()) return Status::Corruption("a key of wrong length");
  record->kind = static_cast<ForbiddenKind>(key.front());
  key.remove_prefix(1);
  if (!TakeBigEndian32(&key, &record->a) || !TakeBigEndian32(&key, &record->b) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return Damaged(Check(*record));
}

Status Check(const ForbiddenRecord& record) {
  if (record.kind < ForbiddenKind::kPair || record.kind > ForbiddenKind::kPose)
    return Broken("kind of what is forbidden", static_cast<int>(record.kind), "1 to 3");
  if (record.a == 0) return Broken("first id", 0, "1 or more");
  if (record.kind == ForbiddenKind::kPose) {
    if (record.a == record.b) return Status::Ok();
    return Broken("second id", record.b, "the first, " + std::to_string(record.a));
  }
  if (record.a >= record.b)
    return Broken("second id", record.b, "greater than the first, " + std::to_string(record.a));
  return Status::Ok();
}

Result<std::string> Encode(const ForbiddenRecord& record) {
  VEDUTA_RETURN_IF_ERROR(Check(record));
  const size_t payload = record.actor.size() + record.reason.size();
  return WriteMessage<schema::Forbidden>(payload, [&](auto to) {
    to.setTimeUnixS(record.time_unix_s);
    to.setActor(AsText(record.actor));
    to.setReason(AsText(record.reason));
  });
}

Status Decode(std::string_view value, ForbiddenRecord* record) {
  return ReadMessage<schema::Forbidden>(value, [&](schema::Forbidden::Reader from) {
    record->time_unix_s = from.getTimeUnixS();
    record->actor = FromText(from.getActor());
    record->reason = FromText(from.getReason());
    return Damaged(Check(*record));
  });
}

}  // namespace veduta
