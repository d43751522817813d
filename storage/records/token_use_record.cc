// SPDX-License-Identifier: Apache-2.0
#include "storage/records/token_use_record.h"

#include <cmath>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string TokenUseKey(uint32_t token) {
  return std::string(kTokenUsePrefix) + Key32(token);
}

Status ParseTokenUseKey(std::string_view key, TokenUse* use) {
  if (!key.starts_with(kTokenUsePrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kTokenUsePrefix.size());
  if (!TakeBigEndian32(&key, &use->token) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return Status::Ok();
}

Status Check(const TokenUse& use) {
  for (const double used : {use.photos, use.bytes, use.reports, use.contributions}) {
    if (!std::isfinite(used) || used < 0) return Broken("use of a quota", used, "0 or more");
  }
  return Status::Ok();
}

Result<std::string> Encode(const TokenUse& use) {
  VEDUTA_RETURN_IF_ERROR(Check(use));
  return WriteMessage<schema::TokenUse>(0, [&](auto to) {
    to.setTimeUnixMs(use.time_unix_ms);
    to.setPhotos(use.photos);
    to.setBytes(use.bytes);
    to.setReports(use.reports);
    to.setContributions(use.contributions);
  });
}

Status Decode(std::string_view value, TokenUse* use) {
  return ReadMessage<schema::TokenUse>(value, [&](schema::TokenUse::Reader from) {
    use->time_unix_ms = from.getTimeUnixMs();
    use->photos = from.getPhotos();
    use->bytes = from.getBytes();
    use->reports = from.getReports();
    use->contributions = from.getContributions();
    return Damaged(Check(*use));
  });
}

}  // namespace veduta
