// SPDX-License-Identifier: Apache-2.0
#pragma once
// Makes a city anew from its photos, by the ordinary engine: slow, and sound by construction.

#include <vector>

#include "engine/engine.h"
#include "engine/repair/healing.h"

namespace veduta {

// Adds the loose photos whose camera is known, and does what follows from what the healing has left
// to do. O(photos that lost their place).
Status AddLoosePhotos(const HealingWork& healing, Engine* engine);

// Adds the cameras and all photos of the healing to a new database, in the order of their ids. The
// images get new ids; the dense pass is left to the user. `healing` was run without a target. What
// people have forbidden of photos is stated anew, under the same names, as soon as the photos are
// there, so that all later ones are placed with it; what is about a photo that is lost goes with
// the photo. The originals of photos with filled areas are sealed anew. Returns what else is not
// kept: merges that are forbidden, for the reconstructions that they name are no more, and what is
// about a photo that is rejected now.
Result<std::vector<RepairNotes::Finding>> RebuildFromPhotos(const HealingWork& healing,
                                                            Engine* engine);

}  // namespace veduta
