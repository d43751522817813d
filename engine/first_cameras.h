// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cameras that a city begins with, where nobody names one.

#include <set>
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

// Whether there is a camera that photos await.
Result<bool> AwaitsPhotos(const Snapshot& snapshot);
// The cameras that one of these photos awaited are awaited no more: all that were to be added
// together were tried.
Status EndAwaiting(EngineParts* parts, const std::set<ContentHash>& photos);

}  // namespace veduta
