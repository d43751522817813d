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

// What a view lacks of what the images see that share most of its points. The view has a pose and
// its points, which are loaded, and need not be in the map. Loads what is around.
Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view);

// Those of the images that lie in `own` and that the pictures of `other` fit clearly better than
// those of `own` do (IsClearlyBetter): the image gets a pose in `other` by its verified pairs, and
// what it would lack there is compared with what it lacks where it is. So are those that fit well
// there, while where they are too little is known to say (a reconstruction of three or four images
// may be of two twin facades). In the order of `images`.
// Loads what it needs and changes nothing. Deterministic. O(images * neighbourhood).
Result<std::vector<DoubtedImage>> FindMisplaced(const MappingContext& context,
                                                std::span<const ImageId> images,
                                                ReconstructionId own, ReconstructionId other);

}  // namespace veduta
