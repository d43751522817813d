// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tokens of the daemon: entries of family `meta`. FORMAT.md, section "token_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/token.h"

namespace veduta {

inline constexpr std::string_view kTokenPrefix = "token/";
std::string TokenKey(uint32_t number);
// Fills the number. kCorruption for any other key.
Status ParseTokenKey(std::string_view key, TokenRecord* token);

Status Check(const TokenRecord& token);
Result<std::string> Encode(const TokenRecord& token);
// `token` has its number already.
Status Decode(std::string_view value, TokenRecord* token);

}  // namespace veduta
