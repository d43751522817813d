// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a camera was on the earth, for a person.

#include <string>

#include "engine/engine.h"

namespace veduta {

// One line, which begins with `indent`.
void PrintEarthPose(const EarthPose& pose, const std::string& indent);

}  // namespace veduta
