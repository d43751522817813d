// SPDX-License-Identifier: Apache-2.0
#pragma once
// The door's answers, read from one snapshot. All functions are thread-safe.

#include <string>
#include <vector>

#include "engine/door/answers.h"
#include "engine/door/calibration.h"
#include "engine/door/moderation.h"
#include "engine/door/submission.h"
#include "engine/query/unsure_poses.h"
#include "storage/database.h"

namespace veduta {

// The camera of that name. kNotFound lists those there are.
Result<CameraRecord> FindCamera(const Snapshot& snapshot, const std::string& name);

// `unsure` is shared by all who ask; so is that of the next. Images and reconstructions that are
// out of sight are left out of the answers; counts are those of all of the city.
Result<StatusAnswer> StatusOf(const Snapshot& snapshot, const DatabaseSizes& sizes,
                              UnsureCache* unsure, const Sight& sight = {});
Result<ImageAnswer> ImageAnswerOf(const Snapshot& snapshot, const ImageRecord& image,
                                  UnsureCache* unsure, const Sight& sight = {});
// Verified neighbours, most matches first, then ascending images.
Result<std::vector<NeighborAnswer>> NeighborsOf(const Snapshot& snapshot, ImageId image,
                                                const Sight& sight = {});
// What the dense pass has made of it is counted too: O(its depth maps and tiles).
Result<ReconstructionAnswer> ReconstructionAnswerOf(const Snapshot& snapshot,
                                                    const ReconstructionRecord& record);
// Those of a reconstruction, or all where it is not valid(); ascending ids. None to who sees a part
// of the city alone, since each is about two reconstructions.
Result<std::vector<HypothesisAnswer>> HypothesesOf(const Snapshot& snapshot,
                                                   ReconstructionId reconstruction,
                                                   const Sight& sight = {});
CameraAnswer CameraAnswerOf(CameraRecord record);
Result<std::vector<CameraAnswer>> CamerasOf(const Snapshot& snapshot);
Result<std::vector<ForbiddenAnswer>> ForbiddenOf(const Snapshot& snapshot);
Result<std::vector<JournalAnswer>> JournalOf(const Snapshot& snapshot, uint64_t first,
                                             uint32_t count_max, const Sight& sight = {});

PlainPose ToPlain(const Rigid3& cam_from_world);

}  // namespace veduta
