// SPDX-License-Identifier: Apache-2.0
#include "storage/records/hidden_record.h"

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string HiddenKey(HiddenKind kind, uint32_t number) {
  return std::string(kHiddenPrefix) + TaggedKey(static_cast<uint8_t>(kind), Key32(number));
}

Status ParseHiddenKey(std::string_view key, HiddenRecord* hidden) {
  if (!key.starts_with(kHiddenPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kHiddenPrefix.size());
  if (key.empty()) return Status::Corruption("a key of wrong length");
  hidden->kind = static_cast<HiddenKind>(key.front());
  key.remove_prefix(1);
  if (!TakeBigEndian32(&key, &hidden->number) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return Damaged(Check(*hidden));
}

Status Check(const HiddenRecord& hidden) {
  if (hidden.kind < HiddenKind::kImage || hidden.kind > HiddenKind::kContribution)
    return Broken("kind of what is hidden", static_cast<int>(hidden.kind), "1 or 2");
  if (hidden.number == 0) return Broken("number of what is hidden", 0, "1 or more");
  return Status::Ok();
}

Result<std::string> Encode(const HiddenRecord& hidden) {
  VEDUTA_RETURN_IF_ERROR(Check(hidden));
  const size_t payload = hidden.actor.size() + hidden.reason.size();
  return WriteMessage<schema::Hidden>(payload, [&](auto to) {
    to.setTimeUnixS(hidden.time_unix_s);
    to.setActor(AsText(hidden.actor));
    to.setReason(AsText(hidden.reason));
  });
}

Status Decode(std::string_view value, HiddenRecord* hidden) {
  return ReadMessage<schema::Hidden>(value, [&](schema::Hidden::Reader from) {
    hidden->time_unix_s = from.getTimeUnixS();
    hidden->actor = FromText(from.getActor());
    hidden->reason = FromText(from.getReason());
    return Damaged(Check(*hidden));
  });
}

}  // namespace veduta
