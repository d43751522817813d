// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of what the city answers. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const UploadAnswer& upload);
Json ToJson(const StatusAnswer& status);
Json ToJson(const ReconstructionAnswer& reconstruction);
Json ToJson(const HypothesisAnswer& hypothesis);
Json ToJson(const ImageAnswer& image);
Json ToJson(const ListedImage& image);
Json ToJson(const DepthMapAnswer& depth_map);
Json ToJson(const PoseUncertainty& uncertainty);
Json ToJson(const NeighborAnswer& neighbor);  // of a stored image: its matches were verified
Json ToJson(const CameraAnswer& camera);
Json ToJson(const VocabularyAnswer& vocabulary);
Json ToJson(const JournalAnswer& entry);
Json ToJson(const RepairAnswer& repair);
Json ToJson(const CalibratedPhoto& photo);

// A reconstruction with the merges of it that are not believed yet.
Json ReconstructionJson(const ReconstructionAnswer& reconstruction,
                        const std::vector<HypothesisAnswer>& hypotheses);
// Ranked candidates for a photo that is not stored: they have scores instead of matches.
Json CandidatesJson(const std::vector<NeighborAnswer>& candidates);
// An image that has a pose: where it was taken.
Json PoseJson(const ImageAnswer& image);
// What Questions::Verify found; none: the database is sound.
Json ViolationsJson(const std::vector<std::string>& violations);
Json DigestJson(const std::string& digest);
// What the camera file of a calibration holds; docs/calibration.md lists its keys.
Json CameraFileJson(const CalibrationAnswer& calibration);

}  // namespace veduta
