// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a repair has done, as a text for the user to keep.

#include <string>

#include "engine/door/repair.h"

namespace veduta {

// UTF-8, one line for each damage and for each photo.
std::string RepairReport(const std::string& database, const RepairAnswer& answer);

}  // namespace veduta
