// SPDX-License-Identifier: Apache-2.0
#include "storage/records/token_record.h"

#include <algorithm>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string TokenKey(uint32_t number) {
  return std::string(kTokenPrefix) + Key32(number);
}

Status ParseTokenKey(std::string_view key, TokenRecord* token) {
  if (!key.starts_with(kTokenPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kTokenPrefix.size());
  if (!TakeBigEndian32(&key, &token->number) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return token->number > 0 ? Status::Ok() : Status::Corruption("a token with the number 0");
}

Status Check(const TokenRecord& token) {
  if (token.number == 0) return Broken("number of a token", 0, "1 or more");
  if (token.name.empty()) return Broken("name of a token", "empty", "given");
  if (token.role < Role::kViewer || token.role > Role::kAdmin)
    return Broken("role", static_cast<int>(token.role), "1 to 4");
  if (token.is_link && token.role != Role::kViewer)
    return Broken("role of a link", static_cast<int>(token.role), "1");
  if (token.is_link && token.expires_unix_s == 0) return Broken("end of a link", 0, "given");
  const bool is_part = token.contribution != 0 || token.reconstruction != 0;
  if (is_part && !token.is_link) return Broken("part that a token shows", "given", "a link's");
  if (token.contribution != 0 && token.reconstruction != 0)
    return Broken("parts that a link shows", 2, "1 at most");
  return Status::Ok();
}

Result<std::string> Encode(const TokenRecord& token) {
  VEDUTA_RETURN_IF_ERROR(Check(token));
  return WriteMessage<schema::Token>(token.name.size() + token.hash.size(), [&](auto to) {
    to.setName(AsText(token.name));
    to.setRole(static_cast<uint8_t>(token.role));
    to.setHash(AsData(token.hash.data(), token.hash.size()));
    to.setCreatedUnixS(token.created_unix_s);
    to.setExpiresUnixS(token.expires_unix_s);
    to.setRevokedUnixS(token.revoked_unix_s);
    to.setPhotosPerDay(token.quota.photos_per_day);
    to.setBytesPerDay(token.quota.bytes_per_day);
    to.setRequestsPerSecond(token.quota.requests_per_s);
    to.setIsLink(token.is_link);
    to.setContribution(token.contribution);
    to.setReconstruction(token.reconstruction);
  });
}

Status Decode(std::string_view value, TokenRecord* token) {
  return ReadMessage<schema::Token>(value, [&](schema::Token::Reader from) {
    token->name = FromText(from.getName());
    token->role = static_cast<Role>(from.getRole());
    const capnp::Data::Reader hash = from.getHash();
    if (hash.size() != token->hash.size()) return BadRows("hash");
    std::copy(hash.begin(), hash.end(), token->hash.begin());
    token->created_unix_s = from.getCreatedUnixS();
    token->expires_unix_s = from.getExpiresUnixS();
    token->revoked_unix_s = from.getRevokedUnixS();
    token->quota = {from.getPhotosPerDay(), from.getBytesPerDay(), from.getRequestsPerSecond()};
    token->is_link = from.getIsLink();
    token->contribution = from.getContribution();
    token->reconstruction = from.getReconstruction();
    return Damaged(Check(*token));
  });
}

}  // namespace veduta
