// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tokens, by which the daemon knows who asks.

#include <cstdint>
#include <string>

#include "storage/base/status.h"
#include "storage/model/token.h"

namespace veduta {

struct TokenRequest {
  std::string name;  // whose it will be; not empty, at most 100 bytes
  Role role = Role::kViewer;
  int64_t expires_unix_s = 0;  // 0: never
  TokenQuota quota;
  // It is for a link that lets whoever has it read: a viewer's, and it must expire.
  bool is_link = false;
  // A link may show photos of one contribution alone, or one reconstruction; 0: all of the city.
  uint32_t contribution = 0, reconstruction = 0;
  std::string actor = "anonymous";  // who asks for it, for the journal

  Status Check() const;  // the first violated bound, named with its value
};

struct NewToken {
  uint32_t number = 0;
  // To be given to its owner: it is stored nowhere, and cannot be told again.
  std::string text;
};

// What is known of a token; nothing of this lets anybody in.
struct TokenAnswer {
  uint32_t number = 0;
  std::string name;
  Role role = Role::kViewer;
  int64_t created_unix_s = 0, expires_unix_s = 0, revoked_unix_s = 0;  // 0: never
  TokenQuota quota;
  bool is_link = false;
  uint32_t contribution = 0, reconstruction = 0;  // that a link shows; 0: all of the city
};

// "viewer", "contributor", "curator", "admin".
std::string RoleWord(Role role);
// kInvalidArgument lists the four.
Result<Role> ParseRole(const std::string& word);

}  // namespace veduta
