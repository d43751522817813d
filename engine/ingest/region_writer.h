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

// Takes out of the reconstruction what of `found` is still in it, for that may have been found some
// commits ago: images lose their poses, and parts of three images and more are split off. Loads
// what is around them, whose submaps are due then, and writes as WriteRegion does; `record` alone
// where nothing of it is left.
Status TakeOutOfRegion(const IngestParts& parts, const WriteScope& scope,
                       ReconstructionRecord record, const Healing& found, HealingWriter* writer,
                       Submaps* submaps);

}  // namespace veduta
