// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `meta`: the format's number and the state. FORMAT.md, section "state_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/state.h"

namespace veduta {

inline constexpr std::string_view kFormatKey = "format";  // a u32
inline constexpr std::string_view kStateKey = "state";

Status Check(const DatabaseState& state);
Result<std::string> Encode(const DatabaseState& state);
Status Decode(std::string_view value, DatabaseState* state);

}  // namespace veduta
