// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of what became of photos that came in, or were asked about. docs/json.md lists
// every key.

#include <string>

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

// "placed", "merged", "founded", "postponed", "rejected", "duplicate" or "failed".
std::string OutcomeWord(const AddOutcome& outcome);
// Why, as a person reads it.
std::string OutcomeReason(const AddOutcome& outcome);
// "localized", "refused", "rejected" or "failed".
std::string LocalizedWord(const LocalizedPhoto& photo);
// Why, as a person reads it.
std::string LocalizedReason(const LocalizedPhoto& photo);
// "propagation", "adjustment", "judgment" or "vocabulary".
std::string FollowUpWord(FollowUpKind kind);

Json ToJson(const DamagedImage& damaged);
Json ToJson(const LostPose& lost);
Json ToJson(const LocalizedPhoto& photo);
Json ToJson(const AddOutcome& outcome);
Json ToJson(const StepTimes& times);
Json ToJson(const FollowUp& step);
Json ToJson(const FirstCamera& camera);
// What ToJson tells of it, as a person reads it.
std::string FirstCameraText(const Json& camera);

}  // namespace veduta
