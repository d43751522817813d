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

// Splits off what `healing` names by `writer`, and puts into the transaction what has changed in
// the map: poses, points, the record of the reconstruction, hypotheses, what waits again. Submaps
// around the region that see less now are due. The submaps, the state and the commit are the
// caller's. O(the region).
Status WriteRegion(const IngestParts& parts, const WriteScope& scope, ReconstructionRecord record,
                   const Region& region, const Healing& healing, HealingWriter* writer,
                   Submaps* submaps);

}  // namespace veduta
