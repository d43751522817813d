// SPDX-License-Identifier: Apache-2.0
#include "cli/service/path_numbers.h"

#include <charconv>
#include <limits>

namespace veduta {

Result<uint64_t> WholeNumber(const std::string& what, const std::string& text, uint64_t min,
                             uint64_t max) {
  uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && rest == end && min <= value && value <= max) return value;
  return Status::InvalidArgument(what + " is '" + text + "', and must be a whole number from " +
                                 std::to_string(min) + " to " + std::to_string(max));
}

Result<ReconstructionId> ReconstructionNumber(const std::string& text) {
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t number, WholeNumber("a reconstruction's number", text, 1,
                                                             std::numeric_limits<uint32_t>::max()));
  return ReconstructionId(static_cast<uint32_t>(number));
}

Result<uint64_t> UploadNumber(const std::string& text) {
  return WholeNumber("an upload's number", text, 1, std::numeric_limits<uint64_t>::max());
}

Result<uint32_t> ContributionNumber(const std::string& text) {
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t number, WholeNumber("a contribution's number", text, 1,
                                                             std::numeric_limits<uint32_t>::max()));
  return static_cast<uint32_t>(number);
}

}  // namespace veduta
