// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/token_json.h"

namespace veduta {
namespace {

// Null where it never was.
Json TimeOf(int64_t time_unix_s) {
  return time_unix_s == 0 ? Json(nullptr) : Json(time_unix_s);
}

// Null where the daemon's own limit counts.
Json NumberOf(uint64_t quota) {
  return quota == 0 ? Json(nullptr) : Json(quota);
}

}  // namespace

Json ToJson(const TokenAnswer& token) {
  return {{"number", token.number},
          {"name", token.name},
          {"role", RoleWord(token.role)},
          {"created", token.created_unix_s},
          {"expires", TimeOf(token.expires_unix_s)},
          {"revoked", TimeOf(token.revoked_unix_s)},
          {"photos_per_day", NumberOf(token.quota.photos_per_day)},
          {"bytes_per_day", NumberOf(token.quota.bytes_per_day)},
          {"requests_per_second", NumberOf(token.quota.requests_per_s)},
          {"link", token.is_link},
          {"contribution", NumberOf(token.contribution)},
          {"reconstruction", NumberOf(token.reconstruction)}};
}

Json ToJson(const NewToken& token) {
  return {{"number", token.number}, {"token", token.text}};
}

std::string LinkPath(const std::string& token) {
  return "/#link=" + token;
}

Json LinkJson(const NewToken& token) {
  return {{"number", token.number}, {"path", LinkPath(token.text)}};
}

}  // namespace veduta
