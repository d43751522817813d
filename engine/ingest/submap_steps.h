// SPDX-License-Identifier: Apache-2.0
#pragma once
// The adjustment of reconstructions by their submaps (submaps.h). Each function that is given a
// WriteScope is one transaction. After an error nothing is committed and the map may be half
// changed: the caller clears it.

#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/submaps.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// Parts a reconstruction that has no submaps into some, by its verified pairs. All of them are due.
// O(its images and pairs, and all poses of the database); loads no image.
Status PartIntoSubmaps(const Snapshot& snapshot, ReconstructionId reconstruction,
                       const AdjustmentSchedule& schedule, Submaps* submaps);

// The same as a transaction.
Status PartReconstruction(const IngestParts& parts, ReconstructionId reconstruction,
                          WriteScope scope);

// Adjusts a submap together with those around it (FindGroup), with all that lies around these held,
// and heals them (AdjustRegion): none of them is due then, but for those that are too large or too
// small. A submap that has grown too large is parted instead, and one that is too small joins the
// one that it has most verified pairs with, where there is room; what comes of it is due. What it
// costs does not grow with the reconstruction.
Result<AdjustedWhole> AdjustSubmap(const IngestParts& parts, ReconstructionId reconstruction,
                                   SubmapId submap, WriteScope scope);

}  // namespace veduta
