// SPDX-License-Identifier: Apache-2.0
#include "engine/query/verdict_text.h"

#include "engine/door/answers.h"

namespace veduta {

const char* VerdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPlaced:
      return "placed";
    case Verdict::kMerged:
      return "merged";
    case Verdict::kFounded:
      return "founded";
    case Verdict::kPostponed:
      return "postponed";
    case Verdict::kRejected:
      return "rejected";
  }
  return "unknown";
}

const char* ReasonText(Reason reason) {
  switch (reason) {
    case Reason::kNone:
      return "";
    case Reason::kRegistered:
      return "registered with one reconstruction";
    case Reason::kJoinedReconstructions:
      return "joined reconstructions";
    case Reason::kGoodTriple:
      return "a good triple with two other views";
    case Reason::kPropagated:
      return "placed when a neighbour was";
    case Reason::kNoCandidates:
      return "nothing to compare with";
    case Reason::kNoVerifiedNeighbor:
      return "no verified neighbour";
    case Reason::kTooFewStructurePoints:
      return "too few points of its neighbours are seen";
    case Reason::kResectionFailed:
      return "no pose explains the points seen";
    case Reason::kNoGoodTriple:
      return "no three views make a sound start";
    case Reason::kContradictsNeighbors:
      return "the pose found contradicts other verified neighbours";
    case Reason::kTooFewFeatures:
      return "too few features";
    case Reason::kMissingStructure:
      return "what other photos see there is missing";
    case Reason::kAmbiguous:
      return "two poses explain it nearly as well";
    case Reason::kUndetermined:
      return "what it sees does not say where it stands";
    case Reason::kDoubted:
      return "its pose was taken back";
    case Reason::kForbidden:
      return "somebody has forbidden that it has a pose";
    case Reason::kUnreadable:
      return "cannot be read";
    case Reason::kUnsupportedFormat:
      return "not a format that is read (JPEG, PNG, TIFF, WebP, HEIC)";
    case Reason::kTooLarge:
      return "too large";
    case Reason::kWrongSize:
      return "not the size of its camera";
    case Reason::kNoTexture:
      return "nothing to recognise it by";
    case Reason::kEmptyFile:
      return "an empty file";
    case Reason::kNameTaken:
      return "the name is taken";
  }
  return "unknown";
}

std::string VerdictWord(Verdict verdict) {
  return VerdictText(verdict);
}

std::string ReasonSentence(Reason reason, const std::string& detail) {
  const std::string clause = ReasonText(reason);
  return detail.empty() ? clause : clause + ": " + detail;
}

}  // namespace veduta
