// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction as other programs are told it.

#include <set>

#include "fusion/pass/scene.h"

namespace veduta {

// The images that are not told: those that are not sure of their poses
// (engine/query/unsure_poses.h), and those that a curator has hidden, unless they are wanted.
Result<std::set<ImageId>> ListUntold(const Snapshot& snapshot, bool with_hidden = false);

// The scene without these. Tracks still name them. Errors and cost as of LoadScene.
Result<Scene> LoadToldScene(const Snapshot& snapshot, ReconstructionId reconstruction,
                            bool with_hidden = false);

}  // namespace veduta
