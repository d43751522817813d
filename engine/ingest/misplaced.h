// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images on the wrong side of a seam. Where verified pairs join two reconstructions and the
// pictures contradict that they are one, perhaps neither is wrong as a whole: an image or two took
// one twin facade for the other, and what they share with the other side is what proposes the
// merge.

#include <span>
#include <string>
#include <vector>

#include "engine/ingest/doubt.h"
#include "engine/ingest/mapping_context.h"

namespace veduta {

// What the picture of a view lacks of the points that the images around it see: those images that
// share most points with it. The view has a pose and points, which are loaded, and need not be in
// the map. Loads the images around.
Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view);

// Finds those of `images` that lie in `own` and would stand better in `other`. Each gets a pose in
// `other` by its verified pairs, and what its picture would lack there is compared with what it
// lacks in `own` (IsClearlyBetter). Where too little is known in `own` to say what it lacks (three
// or four images there may show two twin facades), it is enough that it fits well in `other`
// (FitsWell). In the order of `images`. Loads what it needs and changes nothing. Deterministic.
// O(images * neighbourhood).
Result<std::vector<DoubtedImage>> FindMisplaced(const MappingContext& context,
                                                std::span<const ImageId> images,
                                                ReconstructionId own, ReconstructionId other);

}  // namespace veduta
