// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cameras that a city begins with, where nobody names one.

#include <span>
#include <stop_token>
#include <vector>

#include "engine/parts.h"

namespace veduta {

// Engine::CalibrateFirst. All cameras are stored at once, with the photos that await them: where
// the same photos come again, since who added them was interrupted, they have these cameras.
Result<std::vector<FirstCamera>> CalibrateFirst(EngineParts* parts,
                                                std::span<PhotoSubmission> photos,
                                                std::stop_token stop);

// No photo awaits a camera any more: all that were to be added together were tried.
Status EndAwaiting(EngineParts* parts);

}  // namespace veduta
