// SPDX-License-Identifier: Apache-2.0
#pragma once
// Judges a merge anew that was not believed, without a photo that leads to it.

#include <vector>

#include "engine/door/submission.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

struct Judgment {
  ReconstructionId merged_into;    // not valid() where nothing was merged
  std::vector<LostPose> unplaced;  // images on the wrong side of the seam, in ascending ids
};

// Seeks the merge around the images at the seam, and makes it where the evidence allows it by now.
// Otherwise the hypothesis keeps the new votes, and where structure is missing, images on the wrong
// side of the seam (misplaced.h) lose their poses and are tried again, each once since anybody did
// anything. Where too few points agree with any similarity, the one that it has is judged. It is
// deleted where no image at the seam has a pose in its two any more, or no verified pair leads
// across. One transaction. It costs what the search of a photo for a merge costs, and a resection
// of each image at the seam; where it merges, moving the smaller of the two. kNotFound where there
// is none. After an error nothing is committed and the map may be half changed: the caller clears
// it.
Result<Judgment> JudgeAnew(const IngestParts& parts, ReconstructionId a, ReconstructionId b,
                           WriteScope scope);

}  // namespace veduta
