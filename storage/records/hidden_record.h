// SPDX-License-Identifier: Apache-2.0
#pragma once
// What curators have hidden: entries of family `meta`. FORMAT.md, section "hidden_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/moderation.h"

namespace veduta {

inline constexpr std::string_view kHiddenPrefix = "hidden/";
std::string HiddenKey(HiddenKind kind, uint32_t number);
// Fills kind and number. kCorruption for any other key.
Status ParseHiddenKey(std::string_view key, HiddenRecord* hidden);

Status Check(const HiddenRecord& hidden);
Result<std::string> Encode(const HiddenRecord& hidden);
// `hidden` has kind and number already.
Status Decode(std::string_view value, HiddenRecord* hidden);

}  // namespace veduta
