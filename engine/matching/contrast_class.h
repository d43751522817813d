// SPDX-License-Identifier: Apache-2.0
#pragma once
// Features match only within their contrast class: a dark blob never looks like a bright one.

#include <cstdint>

namespace veduta {

inline constexpr int kContrastClassCount = 3;  // negative, none, positive

constexpr int ContrastClassOf(int8_t contrast_sign) {
  return contrast_sign < 0 ? 0 : contrast_sign == 0 ? 1 : 2;
}

}  // namespace veduta
