// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers in addresses.

#include <cstdint>
#include <string>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

// The whole text as a number in [min, max]; kInvalidArgument says what `what` must be.
Result<uint64_t> WholeNumber(const std::string& what, const std::string& text, uint64_t min,
                             uint64_t max);
// The number of a reconstruction, and of an upload, from a part of a path.
Result<ReconstructionId> ReconstructionNumber(const std::string& text);
Result<uint64_t> UploadNumber(const std::string& text);

}  // namespace veduta
