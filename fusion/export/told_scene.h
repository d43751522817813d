// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction as other programs are told it.

#include "fusion/pass/scene.h"

namespace veduta {

// The scene without the images that are not sure of their poses (engine/query/unsure_poses.h).
// Tracks still name them. Errors and cost as of LoadScene.
Result<Scene> LoadToldScene(const Snapshot& snapshot, ReconstructionId reconstruction);

}  // namespace veduta
