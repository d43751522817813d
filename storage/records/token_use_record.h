// SPDX-License-Identifier: Apache-2.0
#pragma once
// What tokens have used of their quotas: entries of family `meta`. FORMAT.md, section
// "token_use_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/token.h"

namespace veduta {

inline constexpr std::string_view kTokenUsePrefix = "quota/";
std::string TokenUseKey(uint32_t token);
// Fills the token's number. kCorruption for any other key.
Status ParseTokenUseKey(std::string_view key, TokenUse* use);

Status Check(const TokenUse& use);
Result<std::string> Encode(const TokenUse& use);
// `use` has the token's number already.
Status Decode(std::string_view value, TokenUse* use);

}  // namespace veduta
