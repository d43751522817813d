// SPDX-License-Identifier: Apache-2.0
#pragma once
// What became of a photo, and why.

#include <cstdint>

namespace veduta {

// Values are stored: append only, never renumber.
enum class Verdict : uint8_t {
  kPlaced = 1,
  kMerged = 2,
  kFounded = 3,
  kPostponed = 4,
  kRejected = 5
};

enum class Reason : uint8_t {
  kNone = 0,
  // why a photo is where it is
  kRegistered = 1,  // placed in one reconstruction
  kJoinedReconstructions = 2,
  kGoodTriple = 3,  // founded a reconstruction with two other views
  kPropagated = 4,  // placed when a neighbor was
  // why it is postponed
  kNoCandidates = 20,           // nothing in the database looks like it
  kNoVerifiedNeighbor = 21,     // candidates failed the geometric check
  kTooFewStructurePoints = 22,  // neighbors are placed, but too few of their points are seen
  kResectionFailed = 23,        // points are seen, but no pose explains enough of them
  kNoGoodTriple = 24,           // neighbors are not placed, and no three views make a sound start
  kContradictsNeighbors = 25,   // the pose found disagrees with other verified neighbors
  kTooFewFeatures = 26,
  kMissingStructure = 27,  // at the pose found, the picture lacks what must be there
  kDoubted = 28,           // it had a pose, and evidence has turned against it
  kAmbiguous = 29,         // two poses explain it nearly as well
  kForbidden = 30,         // a person has forbidden that it has a pose
  kUndetermined = 31,      // what it sees does not say where it stands
  // why it is rejected
  kUnreadable = 40,
  kUnsupportedFormat = 41,
  kTooLarge = 42,
  kWrongSize = 43,
  kNoTexture = 44,  // black, white or out of focus: no features to speak of
  kEmptyFile = 45,
  kNameTaken = 46,  // other content of this contributor is stored under this name
};

}  // namespace veduta
