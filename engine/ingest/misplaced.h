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
#include "engine/mapping/pair_matches.h"
#include "engine/query/unsure_poses.h"
#include "storage/model/hypothesis.h"

namespace veduta {

// What the picture of a view lacks of the points that the images around it see: those images that
// share most points with it. The view has a pose and points, which are loaded, and need not be in
// the map. Loads the images around.
Result<VisibleStructure> JudgeView(const MappingContext& context, const MapImage& view);

// What is to be said against the side on which images stand.
struct SideDoubts {
  // Those that would stand better on the other side: what the picture would lack there is compared
  // with what it lacks here (IsClearlyBetter). Where too little is known here to say what it lacks
  // (three or four images may show two twin facades), it is enough that it fits well there
  // (FitsWell).
  std::vector<DoubtedImage> misplaced;
  // Of the others those that would stand there as well (DoubtOptions::either_side_points_min), or
  // may (either_side_matches_min), and those that lack much here (IsContradicted), though
  // JudgeAround forgives what something may hide: at a seam it is too much. Where the other side
  // has both of two twins, most points may lead to the wrong one, which the picture refutes
  // (IsContradicted): then the other points are asked where the image would stand.
  std::vector<ImageId> unsure;
};

// Weighs the two sides for one image, which is loaded with its neighbourhood: it gets a pose in
// `other` by those of these verified pairs that lead there. Adds to `doubts`. Loads what it needs
// and changes nothing else. Deterministic. O(neighbourhood).
Status WeighSide(const MappingContext& context, ImageId image, std::span<const PairMatches> pairs,
                 ReconstructionId other, SideDoubts* doubts);

// Weighs the two sides for those of `images` that lie in `own`, by their stored pairs, in the order
// of `images`; then for those that share most points with one that is unsure because the other side
// refutes the place to which most of its points lead: they may have come here by it, or it by them;
// 64 of these at most. O((images + 64) * neighbourhood).
Result<SideDoubts> WeighSides(const MappingContext& context, std::span<const ImageId> images,
                              ReconstructionId own, ReconstructionId other);

// Those of `images` in `own` that the other side holds much more strongly: their verified pairs
// there have outweighing_factor times as many matches as those beside them, and half of the points
// that they see there agree with a pose to which nothing is missing. Where two parts of one place
// meet, a photo that came early stands where few points gave it a pose, perhaps a wrong one. None
// where that is so of more than a third of the images in `own`: then the two sides are to be
// merged, or not, as a whole. As WeighSides.
Result<std::vector<DoubtedImage>> FindOutweighed(const MappingContext& context,
                                                 std::span<const ImageId> images,
                                                 ReconstructionId own, ReconstructionId other);

}  // namespace veduta
