// SPDX-License-Identifier: Apache-2.0
#pragma once
// The adjustment of a whole reconstruction (R18).

#include <span>

#include "engine/ingest/doubt.h"
#include "engine/ingest/mapping_context.h"
#include "engine/ingest/reconsidering.h"

namespace veduta {

enum class Lenses { kHeld, kRefined };

// Loads the images as a region, with the images that see the same points. `with_neighbors` adds the
// images of the reconstruction that they have verified pairs with: callers ask for these where the
// reconstruction is too large to be adjusted whole.
Result<Region> LoadRegion(const MappingContext& context, std::span<const ImageId> images,
                          bool with_neighbors);

// Takes the poses and cuts off the parts that `found` names (its evidence is not looked at), and
// takes the poses of images of the parts that see too few points then. All that is around these
// images must be loaded (LoadRegion).
Healing TakeOut(const MappingContext& context, Healing found);

// Does to the region what AdjustReconstruction does to a whole reconstruction. The images around it
// are held, and help to judge: a part is cut off only where all of it lies in the region. The cost
// depends on the region alone.
Result<Healing> AdjustRegion(const MappingContext& context, const Region& region);

// Reconsiders the poses of a reconstruction; then, twice, completes its tracks, adjusts all its
// poses and points, and filters; in between it joins tracks by all verified pairs. What its own
// evidence speaks against then loses its pose, or is cut off (doubt.h), and the rest is adjusted
// once more. Images that see fewer points than a pose needs (observations_min) after all that lose
// theirs, too. Loads all of it. The frame stays (AdjustBundle). After an error the map may be half
// changed: the caller clears it.
// Before all that, focal lengths are refined where `lenses` asks for it (RefineLenses).
Result<Healing> AdjustReconstruction(const MappingContext& context, ReconstructionId id,
                                     Lenses lenses = Lenses::kHeld);

}  // namespace veduta
