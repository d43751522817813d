// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the places stand whose facades are exactly alike.

#include "tools/render/street/plan.h"

namespace veduta::street {

// kInvalidArgument if the scene has no room for its twin facades, with the length that it needs.
Status CheckTwinFacades(const SceneOptions& options);

// The places in `plan`, the two of a pair one after the other. `options` must pass
// CheckTwinFacades(). Deterministic.
std::vector<TwinPlace> PlaceTwins(const SceneOptions& options, const Plan& plan);

// The middle of a place, on the ground at the foot of its facade.
Eigen::Vector2d MiddleOf(const TwinPlace& place, const Plan& plan);

}  // namespace veduta::street
