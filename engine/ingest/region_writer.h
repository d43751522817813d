// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes what a step has done to a region of a reconstruction that has submaps.

#include "engine/ingest/doubt.h"
#include "engine/ingest/healing_writer.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/submaps.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// Splits off, by `writer`, the parts that `healing` names. Puts into the transaction what has
// changed in the map: poses, points, the record of the reconstruction, hypotheses, and the images
// that lost their poses. Submaps around the region become due where an image sees fewer points now
// than a pose needs. The caller writes `submaps` and the state, and commits. O(the region).
Status WriteRegion(const IngestParts& parts, const WriteScope& scope, ReconstructionRecord record,
                   const Region& region, const Healing& healing, HealingWriter* writer,
                   Submaps* submaps);

}  // namespace veduta
