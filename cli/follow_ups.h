// SPDX-License-Identifier: Apache-2.0
#pragma once
// What `add` and `settle` say of the work that follows from photos.

#include <string>
#include <vector>

#include "engine/engine.h"

namespace veduta {

// "the adjustment of reconstruction 3"; images are called by their names.
std::string FollowUpText(const FollowUp& step, const Questions& ask);
// A sentence about a step that failed: which one, why, and what to do about it.
std::string FollowUpFailure(const FollowUp& step, const Questions& ask, const std::string& db);
// A sentence about a stored image that photos could not be compared with.
std::string DamagedImageText(const DamagedImage& damaged, const Questions& ask,
                             const std::string& db);
// One line per image that got a pose: "  then     NAME: why".
void PrintPlacedLater(const std::vector<ImageId>& placed, const Questions& ask);

// What a step took back: "  then     NAME: lost its pose: why", "  then     reconstruction 7 was
// split off".
void PrintHealed(const std::vector<LostPose>& unplaced,
                 const std::vector<ReconstructionId>& split_off, const Questions& ask);

// Which two reconstructions a new judgment has merged, as a sentence; empty for other steps.
std::string JoinedText(const FollowUp& step);

}  // namespace veduta
