// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers in addresses and headers.

#include <cstdint>
#include <string>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

// The whole text as a number in [min, max]; kInvalidArgument says what `what` must be.
Result<uint64_t> WholeNumber(const std::string& what, const std::string& text, uint64_t min,
                             uint64_t max);
// The number of a reconstruction, of an upload, and of a contribution.
Result<ReconstructionId> ReconstructionNumber(const std::string& text);
Result<uint64_t> UploadNumber(const std::string& text);
Result<uint32_t> ContributionNumber(const std::string& text);

}  // namespace veduta
