// SPDX-License-Identifier: Apache-2.0
#pragma once
// What ties submaps to their neighbours: entries of family `meta`. FORMAT.md, section
// "border_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/submap.h"

namespace veduta {

inline constexpr std::string_view kBorderPrefix = "border/";
std::string BorderKey(SubmapId id);
// Fills the id of the record. kCorruption for any other key.
Status ParseBorderKey(std::string_view key, SubmapBorder* border);

Status Check(const SubmapBorder& border);
Result<std::string> Encode(const SubmapBorder& border);
// `border` has its id already.
Status Decode(std::string_view value, SubmapBorder* border);

}  // namespace veduta
