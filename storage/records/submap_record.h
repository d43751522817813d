// SPDX-License-Identifier: Apache-2.0
#pragma once
// The parts of large reconstructions that are adjusted by themselves: entries of family `meta`.
// FORMAT.md, section "submap_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/submap.h"

namespace veduta {

inline constexpr std::string_view kSubmapPrefix = "submap/";
std::string SubmapKey(SubmapId id);
// Fills the id of the record. kCorruption for any other key.
Status ParseSubmapKey(std::string_view key, SubmapRecord* record);

Status Check(const SubmapRecord& record);
Result<std::string> Encode(const SubmapRecord& record);
// `record` has its id already.
Status Decode(std::string_view value, SubmapRecord* record);

}  // namespace veduta
