// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lenses that photos of the city alone have told are refined with the structure. One photo, or a
// few, tell the focal length to some percent; and a city that began with a wrong one has it
// everywhere, for later photos are explained by its points. The photos' features that are stored
// stay as they are, to the last bit; what moves is where the lens has them (carried_features.h).

#include <set>
#include <span>
#include <utility>
#include <vector>

#include "engine/ingest/doubt.h"
#include "engine/ingest/mapping_context.h"
#include "storage/database.h"

namespace veduta {

// Whether an adjustment of the whole reconstruction refines them: at 12 images, which tell
// something, then each time that there are half as many more, up to 600, for it costs time. Not
// where the adjustment is due for another reason, as after a merge: what was believed is judged
// first by the lenses that it was believed with.
bool IsRefinementDue(const ReconstructionRecord& record);

// The cameras of these images, in their order. What was refined with other ones must not be
// written.
using LensesOfImages = std::vector<std::pair<CameraId, CameraModel>>;
Result<LensesOfImages> ListLenses(const Snapshot& snapshot, const std::set<ImageId>& images);

// Refines focal lengths, k1 and k2 in the map, with all poses and points of the reconstruction,
// whose images these are; all of it must be loaded. Where none is refined in the end, the map is as
// it was, to the last bit. Those of cameras that another reconstruction has more images of are
// held. Cameras that began with one lens are refined as one. After an error the map may be half
// changed. O(images of the database, and the adjustment).
Result<std::vector<RefinedLens>> RefineLenses(const MappingContext& context,
                                              ReconstructionId reconstruction,
                                              std::span<const ImageId> images);

// Writes the refined cameras, each with an entry of the journal. Where images of one have their
// poses in another reconstruction, too, whose structure rests on the lens that was, they
// get a camera of their own; it becomes one with the other again when the two are merged. Returns
// the images that have another lens now. Other records of the images that the transaction
// writes must be written later. O(images of the database).
Result<std::vector<ImageId>> WriteLenses(const Snapshot& snapshot, ReconstructionId reconstruction,
                                         std::span<const RefinedLens> lenses, DatabaseState* state,
                                         Transaction* transaction);

}  // namespace veduta
