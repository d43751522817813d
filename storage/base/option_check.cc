// SPDX-License-Identifier: Apache-2.0
#include "storage/base/option_check.h"

#include <cstdio>

namespace veduta {

std::string OptionText(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

}  // namespace veduta
