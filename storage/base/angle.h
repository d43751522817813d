// SPDX-License-Identifier: Apache-2.0
#pragma once
// Angles in degrees, for people, and in radians, for mathematics.

#include <numbers>

namespace veduta {

// Radians in one degree: degrees times this are radians, and radians over this are degrees.
inline constexpr double kRadPerDeg = std::numbers::pi / 180;

}  // namespace veduta
