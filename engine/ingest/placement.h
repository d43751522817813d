// SPDX-License-Identifier: Apache-2.0
#pragma once
// What became of a photo in the map.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/hypothesis.h"
#include "storage/model/verdict.h"

namespace veduta {

// One reconstruction that was merged into another.
struct Merge {
  ReconstructionId from;
  Sim3 into_from;
  uint32_t common_point_count = 0;
  std::string evidence;  // for and against, for a person
};

// A merge that is known as a hypothesis, to which the search of a photo has led.
struct KnownSeam {
  ReconstructionId own, other;
  bool has_grown = false;  // so much that it is to be judged anew
  RefusalReason reason = RefusalReason::kFewPairs;
  // Of the photo and those with which it has verified pairs, who is not sure of their side.
  std::vector<ImageId> unsure = {};
};

// The answer to one photo, and what it changed in the map besides. Or what a new judgment of a
// hypothesis has merged: then nothing was placed, and only the merge is said.
struct Placement {
  Verdict verdict = Verdict::kPostponed;
  Reason reason = Reason::kNone;
  std::string detail;               // the reason's numbers, for a person
  ReconstructionId reconstruction;  // valid unless postponed
  ReconstructionId founded;         // valid if one was founded, also if it was merged at once
  std::vector<ImageId> placed;      // got a pose: the photo first, then those it founded with
  std::vector<Merge> merges;        // in the order in which they were made
  // Merges that were judged and not made, with the reconstruction that the photo is in now.
  std::vector<HypothesisRecord> refused;
  std::vector<KnownSeam> known;  // that the photo's search has led to and not judged
  // Of the images of its reconstruction that which shares most matches with a photo that got a pose
  // by itself: the photo is as sure of its side of a seam.
  ImageId strongest;
  // Where a merge was sought: those that got a pose, and images that share points or verified pairs
  // with them.
  std::vector<ImageId> around;
  // An image whose submap or reconstruction is to be judged as a whole, since new evidence
  // contradicts it: the photo or, if it is postponed, a neighbour. Not valid() where there is none.
  ImageId doubtful;
  uint32_t inlier_count = 0;         // of the pose, or of the founding points
  double map_ms = 0, adjust_ms = 0;  // wall time
};

}  // namespace veduta
