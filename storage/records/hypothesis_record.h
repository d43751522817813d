// SPDX-License-Identifier: Apache-2.0
#pragma once
// Merges that are not believed yet: entries of family `meta`. FORMAT.md, section
// "hypothesis_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/hypothesis.h"

namespace veduta {

inline constexpr std::string_view kHypothesisPrefix = "hypothesis/";
std::string HypothesisKey(ReconstructionId smaller, ReconstructionId larger);
// Fills the two reconstructions of the record. kCorruption for any other key.
Status ParseHypothesisKey(std::string_view key, HypothesisRecord* record);

Status Check(const HypothesisRecord& record);
Result<std::string> Encode(const HypothesisRecord& record);
// `record` has its reconstructions already.
Status Decode(std::string_view value, HypothesisRecord* record);

}  // namespace veduta
