// SPDX-License-Identifier: Apache-2.0
#pragma once
// Looks for the place of reconstructions on the earth: by where photos say they were taken, by
// surveyed points, and by how people hold cameras (engine/earth/).

#include <span>
#include <string>

#include "engine/ingest/write_scope.h"

namespace veduta {

// Whether anything tells where the city is: a photo, or a surveyed point. O(surveyed points).
Result<bool> IsPlaceTold(const Snapshot& snapshot, const DatabaseState& state);

// Whether the place of a reconstruction is to be looked for: when it has grown by a tenth since the
// last look, was adjusted as a whole, or has lost photos; and once more where nothing tells any
// more. O(1).
bool IsLookDue(const ReconstructionRecord& record, bool is_place_told);

// Looks once and commits what is found: a place under its next version, or none where too little is
// told. The origin stays where it was. The frame of the reconstruction stays in any case. An entry
// of the journal tells of a place, and of one that is lost. O(images of the city).
Status LookForPlace(ReconstructionId reconstruction, WriteScope scope);

// Replaces the surveyed points by these and looks for the place of each living reconstruction, all
// in one commit.
Status SetGroundPoints(std::span<const GroundPoint> points, const std::string& actor,
                       WriteScope scope);

}  // namespace veduta
