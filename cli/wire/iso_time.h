// SPDX-License-Identifier: Apache-2.0
#pragma once
// Times as RFC 3339 writes them: "2026-11-26T12:00:00Z".

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// In UTC; `unix_s` in the years 0 to 9999.
std::string IsoTime(int64_t unix_s);

// Seconds since 1970, both included; nothing where it is open.
struct TimeInterval {
  std::optional<int64_t> from_unix_s, to_unix_s;
};

// A time, or two with a slash between, one of which may be empty or ".." (open). Whole seconds that
// are within. kInvalidArgument says what is wrong.
Result<TimeInterval> ParseInterval(std::string_view text);

}  // namespace veduta
