// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `reconstructions`. FORMAT.md, section "reconstruction_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/reconstruction.h"

namespace veduta {

std::string ReconstructionKey(ReconstructionId id);

Status Check(const ReconstructionRecord& reconstruction);
Result<std::string> Encode(const ReconstructionRecord& reconstruction);
Status Decode(std::string_view value, ReconstructionId id, ReconstructionRecord* reconstruction);

}  // namespace veduta
