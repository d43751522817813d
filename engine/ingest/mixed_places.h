// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two places in one reconstruction. A photo that took a twin facade for its own finds beside it
// what other photos see that did the same, and so lacks little of what all see together. But it
// lacks what single photos of the other place see, and these lack what it sees.

#include <span>
#include <vector>

#include "engine/ingest/mapping_context.h"

namespace veduta {

// The images of a reconstruction that show another place than the rest of it: the smaller of the
// two parts, and of two as large that without the first image; ascending. Empty where what speaks
// for two places is too little (DoubtOptions::mixed_pairs_min), also beside the verified pairs that
// agree across (mixed_agreeing_share_max). `images` are those in doubt: of one reconstruction,
// ascending, loaded with their neighbourhoods. Which of the two sides the others of the
// reconstruction belong to, is said by their verified pairs. More than 64 are asked in groups that
// overlap, each of images that see one stretch. Reads the map only. Deterministic. O(images *
// points that 64 of them see), and where there are two places O(the reconstruction).
Result<std::vector<ImageId>> FindOtherPlace(const MappingContext& context,
                                            std::span<const ImageId> images);

}  // namespace veduta
