// SPDX-License-Identifier: Apache-2.0
#pragma once
// Judges a merge anew that was not believed, without a photo that leads to it.

#include "engine/ingest/adjusted_whole.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

struct Judgment {
  ReconstructionId merged_into;  // not valid() where nothing was merged
  AdjustedWhole taken_out;       // images on the wrong side of the seam, or a place of its own
};

// Judges the hypothesis that `a` and `b` are one, in one transaction. Seeks the merge around the
// images at the seam, and merges the two where the evidence allows it by now. Where it leaves it
// open and a loop closes there (seam_loop.h), merges all of the loop. Otherwise stores the new
// votes. What an adjustment has just split stays apart, and only its sides are weighed. Where the
// pictures lack structure, a side that shows two places is split (mixed_places.h), or, after four
// splits between two actions of people, the images of its other place are unsure; or images on the
// wrong side of the seam (misplaced.h) lose their poses and are tried again, each only once while a
// fifth of the photos come (AlreadyDoubted). Nor is anything judged where one of the two was split
// off while such a fifth came, as were two parts before it that were merged back: they stay apart
// until more have come. Where too few points agree with any similarity, that of the hypothesis is
// judged. Deletes the hypothesis where no image at the seam has a pose in `a` or `b` any more, or
// no verified pair leads across. Costs as much as the search of a photo for a merge and a resection
// of each image at the seam; a merge moves the smaller reconstruction besides. kNotFound where
// there is no such hypothesis. After an error nothing is committed and the map may be half changed:
// the caller clears it.
Result<Judgment> JudgeAnew(const IngestParts& parts, ReconstructionId a, ReconstructionId b,
                           WriteScope scope);

}  // namespace veduta
