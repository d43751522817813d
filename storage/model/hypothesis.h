// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the evidence proposes and is not believed yet.

#include <cstdint>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"

namespace veduta {

// Values are stored: append only, never renumber.
enum class HypothesisKind : uint8_t {
  kMerge = 1,  // two reconstructions show the same place
};

// Why a merge is not believed. Values are stored: append only, never renumber.
enum class RefusalReason : uint8_t {
  kFewPairs = 1,          // too few verified pairs across the seam agree
  kContradicted = 2,      // verified pairs across the seam contradict it
  kMissingStructure = 3,  // the pictures lack what they would have to show
  kFewPoints = 4,         // too few common points agree with any similarity by now
  kUndetermined = 5,      // what is seen across does not say exactly enough where the sides are
  kSplit = 6,             // they were one, and an adjustment has split them there
  kOpen = 7,              // verified pairs lead across, and no similarity follows from them
  kFarApart = 8,          // their places on the earth lie far from each other
};

// A merge of two reconstructions that was judged and not made, or that was taken back (kSplit). The
// votes are of the last judgment.
struct HypothesisRecord {
  ReconstructionId a, b;  // a < b; both live
  HypothesisKind kind = HypothesisKind::kMerge;
  RefusalReason reason = RefusalReason::kFewPairs;
  Sim3 a_from_b;  // carries the frame of b into that of a; means nothing where it is open (kOpen)
  uint32_t common_point_count = 0;  // that agree with it; 0 where they are too few
  // Verified pairs across the seam, and matches of theirs as far as a pair counts.
  uint32_t agreeing_pairs = 0, contradicting_pairs = 0;
  uint64_t agreeing_matches = 0, contradicting_matches = 0;
  // Parts of pictures that were judged by what they must show, and those that lack it.
  uint32_t judged_cells = 0, missing_cells = 0;
  // Whose placing proposed it first; not valid() once it was removed, or where it was a split.
  ImageId image;
  std::vector<ImageId> images;  // of either side, with pairs across; ascending, at least one
  // Those of `images` of which it is not sure that they stand on the right side; ascending.
  std::vector<ImageId> unsure;
  uint32_t judgment_count = 1;  // >= 1; how often it was judged
  bool is_due = false;          // what it rests on has changed: it is to be judged anew
  // Images at the seams of the loop by which it was judged last (seam_loop.h); 0 where there was
  // none.
  uint32_t loop_images = 0;
  int64_t time_unix_s = 0;  // of the last judgment
};

}  // namespace veduta
