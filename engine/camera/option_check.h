// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the Check() functions of the options structs in engine/camera share.

#include <initializer_list>

#include "storage/base/status.h"

namespace veduta {

// One field of an options struct, as its Check() sees it.
struct OptionField {
  const char* name;
  double value;
  bool is_allowed;    // write it as a comparison that is false for NaN
  const char* range;  // for the message, as in "[1, 100]" or "(0, inf)"
};

// Ok if all fields are allowed. Otherwise kInvalidArgument for the first one that is not, as in
// "MarkerOptions.offset_gray = 0 is not in [1, 100]".
Status CheckFields(const char* options, std::initializer_list<OptionField> fields);

// Whether a value lies in (0, inf). False for NaN and for infinity.
bool IsPositive(double value);

}  // namespace veduta
