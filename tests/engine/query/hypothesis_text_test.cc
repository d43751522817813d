// SPDX-License-Identifier: Apache-2.0
// Goal: a person reads why a merge is not believed, with every vote.
// Method: one hypothesis under each reason; numbers of one and of more.
#include "engine/query/hypothesis_text.h"

#include <gtest/gtest.h>

#include <set>

namespace veduta {
namespace {

TEST(RefusalText, SaysTheReasonAndTheVotes) {
  HypothesisRecord hypothesis;
  hypothesis.reason = RefusalReason::kContradicted;
  hypothesis.common_point_count = 24;
  hypothesis.agreeing_pairs = 1;
  hypothesis.agreeing_matches = 90;
  hypothesis.contradicting_pairs = 3;
  hypothesis.contradicting_matches = 1;
  hypothesis.judged_cells = 40;
  hypothesis.missing_cells = 12;
  EXPECT_EQ(RefusalText(hypothesis),
            "pairs of photos across the seam contradict it: 24 common points; 1 pair agrees (90 "
            "matches), 3 contradict (1 match); 12 of 40 parts of the pictures lack what they must "
            "show");
}

TEST(RefusalText, OneThatIsOpenHasNoVotes) {
  HypothesisRecord hypothesis;
  hypothesis.reason = RefusalReason::kOpen;
  hypothesis.images = {ImageId(1), ImageId(2)};
  EXPECT_EQ(RefusalText(hypothesis),
            "pairs of photos lead across and do not say how the two lie to each other: 2 photos "
            "are at the seam");
}

TEST(RefusalText, EveryReasonHasItsOwnClause) {
  std::set<std::string> clauses;
  for (int reason = 1; reason <= 7; ++reason) {
    HypothesisRecord hypothesis;
    hypothesis.reason = static_cast<RefusalReason>(reason);
    clauses.insert(RefusalText(hypothesis));
  }
  EXPECT_EQ(clauses.size(), 7u);
}

}  // namespace
}  // namespace veduta
