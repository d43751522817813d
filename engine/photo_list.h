// SPDX-License-Identifier: Apache-2.0
#pragma once
// Engine::AddPhotos, and its like for photos whose poses are to come.

#include <functional>
#include <span>
#include <stop_token>

#include "engine/parts.h"

namespace veduta {

// Adds the photos in their order; where `awaited` has one for each, they wait for their poses.
// Otherwise as Engine::AddPhotos says. `parts` must outlive the call.
Status AddList(EngineParts* parts, std::span<const PhotoSubmission> photos,
               std::span<const AwaitedPose> awaited,
               const std::function<void(const AddOutcome&)>& report, const std::stop_token& stop,
               const std::function<void(const FollowUp&)>& followed);

}  // namespace veduta
