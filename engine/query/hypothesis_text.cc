// SPDX-License-Identifier: Apache-2.0
#include "engine/query/hypothesis_text.h"

#include "storage/base/status.h"

namespace veduta {
namespace {

std::string ReasonClause(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kFewPairs:
      return "too few pairs of photos across the seam agree";
    case RefusalReason::kContradicted:
      return "pairs of photos across the seam contradict it";
    case RefusalReason::kMissingStructure:
      return "the pictures of one side lack what the other side sees";
    case RefusalReason::kFewPoints:
      return "too few common points agree with it";
    case RefusalReason::kUndetermined:
      return "what is seen across says too little of where the two sides are";
    case RefusalReason::kSplit:
      return "an adjustment has split them there";
    case RefusalReason::kOpen:
      return "pairs of photos lead across and do not say how the two lie to each other";
    case RefusalReason::kFarApart:
      return "their places on the earth lie far from each other";
  }
  VEDUTA_CHECK(false, "a reason that no record has: " + std::to_string(static_cast<int>(reason)));
  return "";
}

std::string Number(uint64_t number, const char* one, const char* more) {
  return std::to_string(number) + " " + (number == 1 ? one : more);
}

}  // namespace

std::string RefusalText(const HypothesisRecord& h) {
  if (h.reason == RefusalReason::kOpen)
    return ReasonClause(h.reason) + ": " + Number(h.images.size(), "photo is", "photos are") +
           " at the seam";
  return ReasonClause(h.reason) + ": " +
         Number(h.common_point_count, "common point", "common points") + "; " +
         Number(h.agreeing_pairs, "pair agrees", "pairs agree") + " (" +
         Number(h.agreeing_matches, "match", "matches") + "), " +
         std::to_string(h.contradicting_pairs) + " contradict (" +
         Number(h.contradicting_matches, "match", "matches") + "); " +
         std::to_string(h.missing_cells) + " of " + Number(h.judged_cells, "part", "parts") +
         " of the pictures lack what they must show";
}

}  // namespace veduta
