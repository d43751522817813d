// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cameras that a city begins with, where nobody names one.

#include <span>
#include <stop_token>
#include <vector>

#include "engine/parts.h"

namespace veduta {

// Engine::CalibrateFirst.
Result<std::vector<FirstCamera>> CalibrateFirst(EngineParts* parts,
                                                std::span<PhotoSubmission> photos,
                                                std::stop_token stop);

}  // namespace veduta
