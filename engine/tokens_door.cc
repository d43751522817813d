// SPDX-License-Identifier: Apache-2.0
// The members of Engine and Questions that are about tokens, by libsodium.
#include <sodium.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <vector>

#include "engine/engine.h"
#include "engine/ingest/write_scope.h"
#include "engine/journal/journal.h"
#include "engine/parts.h"
#include "storage/base/option_bounds.h"
#include "storage/base/plain_text.h"

namespace veduta {
namespace {

constexpr std::string_view kMark = "veduta-";  // by which people and scanners know one
constexpr size_t kNameBytesMax = 100;
constexpr size_t kSecretBytes = 32;
constexpr int kBase64 = sodium_base64_VARIANT_URLSAFE_NO_PADDING;

constexpr std::pair<Role, const char*> kRoles[] = {{Role::kViewer, "viewer"},
                                                   {Role::kContributor, "contributor"},
                                                   {Role::kCurator, "curator"},
                                                   {Role::kAdmin, "admin"}};

Status StartSodium() {
  return sodium_init() < 0 ? Status::IoError("libsodium cannot start: there are no random numbers")
                           : Status::Ok();
}

using Hash = std::array<uint8_t, 32>;

// The secrets are as long as the hash and random, so nothing slower is called for.
Hash HashOf(std::string_view secret) {
  Hash hash;
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const uint8_t*>(secret.data()),
                     secret.size(), nullptr, 0);
  return hash;
}

std::string NewSecret() {
  uint8_t bytes[kSecretBytes];
  randombytes_buf(bytes, sizeof(bytes));
  char text[sodium_base64_ENCODED_LEN(kSecretBytes, kBase64)];
  sodium_bin2base64(text, sizeof(text), bytes, sizeof(bytes), kBase64);
  sodium_memzero(bytes, sizeof(bytes));
  return text;
}

TokenAnswer ToAnswer(const TokenRecord& token) {
  return {token.number,         token.name,           token.role,  token.created_unix_s,
          token.expires_unix_s, token.revoked_unix_s, token.quota, token.is_link,
          token.contribution,   token.reconstruction};
}

std::string TextOf(const TokenRecord& token) {
  return (token.is_link ? "link" : RoleWord(token.role) + " token") + " " +
         std::to_string(token.number) + " of " + token.name;
}

}  // namespace

std::string RoleWord(Role role) {
  const auto found = std::ranges::find(kRoles, role, &std::pair<Role, const char*>::first);
  return found == std::end(kRoles) ? "unknown" : found->second;
}

Result<Role> ParseRole(const std::string& word) {
  for (const auto& [role, name] : kRoles) {
    if (word == name) return role;
  }
  return Status::InvalidArgument("the role is '" + word +
                                 "', and must be viewer, contributor, curator or admin");
}

Status TokenRequest::Check() const {
  if (name.empty() || name.size() > kNameBytesMax)
    return Status::InvalidArgument("name has " + std::to_string(name.size()) +
                                   " bytes, but must have 1 to " + std::to_string(kNameBytesMax));
  if (!IsPlainText(name, /*may_have_lines=*/false))
    return Status::InvalidArgument("name is no UTF-8, or has control characters");
  if ((contribution != 0 || reconstruction != 0) && !is_link)
    return Status::InvalidArgument("a link alone shows one contribution or one reconstruction");
  if (contribution != 0 && reconstruction != 0)
    return Status::InvalidArgument("a contribution and a reconstruction exclude each other");
  if (is_link && (role != Role::kViewer || expires_unix_s <= 0))
    return Status::InvalidArgument("a link is for viewers, and must expire");
  return OptionBounds()
      .Between("role", static_cast<double>(role), 1, 4)
      .AtLeast("expires_unix_s", static_cast<double>(expires_unix_s), 0)
      .status();
}

Result<std::vector<TokenAnswer>> Questions::Tokens() const {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<TokenRecord> all, view_->snapshot->ListTokens());
  std::vector<TokenAnswer> answers;
  for (const TokenRecord& token : all) answers.push_back(ToAnswer(token));
  return answers;
}

Result<std::optional<TokenAnswer>> Questions::CheckToken(const std::string& text) const {
  std::string_view rest = text;
  if (!rest.starts_with(kMark)) return std::optional<TokenAnswer>();
  rest.remove_prefix(kMark.size());
  if (rest.starts_with('0')) return std::optional<TokenAnswer>();  // a token has one spelling
  uint32_t number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc() || end == rest.data() + rest.size() || *end != '-')
    return std::optional<TokenAnswer>();
  rest.remove_prefix(static_cast<size_t>(end + 1 - rest.data()));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<TokenRecord> token,
                          view_->snapshot->FindToken(number));
  // As long for a number that there is not.
  const Hash hash = HashOf(rest), stored = token ? token->hash : Hash{};
  const bool is_right = sodium_memcmp(hash.data(), stored.data(), hash.size()) == 0;
  if (!token || !is_right || token->revoked_unix_s != 0) return std::optional<TokenAnswer>();
  if (token->expires_unix_s != 0 && token->expires_unix_s <= std::time(nullptr))
    return std::optional<TokenAnswer>();
  return std::optional(ToAnswer(*token));
}

Result<NewToken> Engine::CreateToken(const TokenRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  if (request.contribution != 0)
    VEDUTA_RETURN_IF_ERROR(Ask().Contribution(request.contribution).status());
  if (request.reconstruction != 0)
    VEDUTA_RETURN_IF_ERROR(Ask().Reconstruction(ReconstructionId(request.reconstruction)).status());
  VEDUTA_RETURN_IF_ERROR(StartSodium());
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<TokenRecord> all, scope.base->ListTokens());
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  const std::string secret = NewSecret();
  TokenRecord token;
  token.number = all.empty() ? 1 : all.back().number + 1;
  token.name = request.name;
  token.role = request.role;
  token.hash = HashOf(secret);
  token.created_unix_s = std::time(nullptr);
  token.expires_unix_s = request.expires_unix_s;
  token.quota = request.quota;
  token.is_link = request.is_link;
  token.contribution = request.contribution;
  token.reconstruction = request.reconstruction;
  scope.transaction->PutToken(token);
  AppendJournal({0, 0, request.actor, "token", {}, {}, "made " + TextOf(token)}, &state,
                scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  return NewToken{token.number, std::string(kMark) + std::to_string(token.number) + "-" + secret};
}

Status Engine::RevokeToken(uint32_t number, const std::string& actor) {
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(std::optional<TokenRecord> token, scope.base->FindToken(number));
  if (!token) return Status::NotFound("there is no token " + std::to_string(number));
  if (token->revoked_unix_s != 0) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  token->revoked_unix_s = std::time(nullptr);
  scope.transaction->PutToken(*token);
  AppendJournal({0, 0, actor, "token", {}, {}, "revoked " + TextOf(*token)}, &state,
                scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

}  // namespace veduta
