// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers as people read them. Independent of the locale.

#include <string>

namespace veduta {

// The shortest decimal text of a number that reads back as the same number.
std::string NumberText(double value);

}  // namespace veduta
