// SPDX-License-Identifier: Apache-2.0
#pragma once
// How the Check of an options struct words a violated bound.

#include <concepts>
#include <cstdint>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// "0.5", "1e-09", "nan": as few digits as tell the number apart to nine places.
std::string OptionText(double value);

// Ok where `holds`, else kInvalidArgument "NAME is VALUE; it must be in RANGE". Write `holds` as
// what must be true, so that a number that is not one (NaN) fails:
//   VEDUTA_RETURN_IF_ERROR(CheckOption(share > 0 && share <= 1, "share", share, "(0, 1]"));
template <std::floating_point Number>
Status CheckOption(bool holds, const char* name, Number value, const char* range) {
  if (holds) return Status::Ok();
  return Status::InvalidArgument(std::string(name) + " is " +
                                 OptionText(static_cast<double>(value)) + "; it must be in " +
                                 range);
}
template <std::integral Number>
Status CheckOption(bool holds, const char* name, Number value, const char* range) {
  if (holds) return Status::Ok();
  return Status::InvalidArgument(std::string(name) + " is " + std::to_string(value) +
                                 "; it must be in " + range);
}

}  // namespace veduta
