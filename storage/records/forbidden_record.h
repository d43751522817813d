// SPDX-License-Identifier: Apache-2.0
#pragma once
// What people have forbidden: entries of family `meta`. FORMAT.md, section "forbidden_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/forbidden.h"

namespace veduta {

inline constexpr std::string_view kForbiddenPrefix = "forbidden/";
std::string ForbiddenKey(ForbiddenKind kind, uint32_t smaller, uint32_t larger);
// Fills kind and ids of the record. kCorruption for any other key.
Status ParseForbiddenKey(std::string_view key, ForbiddenRecord* record);

Status Check(const ForbiddenRecord& record);
Result<std::string> Encode(const ForbiddenRecord& record);
// `record` has kind and ids already.
Status Decode(std::string_view value, ForbiddenRecord* record);

}  // namespace veduta
