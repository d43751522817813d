// SPDX-License-Identifier: Apache-2.0
// Goal: a pair's record as either image sees it, and back again.
// Method: a pair of a synthetic scene.
#include "engine/mapping/pair_matches.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(PairMatches, AreTheRecordFromEitherSide) {
  const SyntheticScene scene = MakeScene({});
  PairRecord record = scene.Pair(1, 4);
  record.lens_a.focal_px = 900;
  record.lens_b.focal_px = 800;
  const PairMatches by_a = MatchesFrom(record, record.a), by_b = MatchesFrom(record, record.b);
  EXPECT_EQ(by_a.other, record.b);
  EXPECT_EQ(by_b.other, record.a);
  EXPECT_EQ(by_a.matches, record.matches);
  for (size_t i = 0; i < record.matches.size(); ++i) {
    EXPECT_EQ(by_b.matches[i].a, record.matches[i].b);
    EXPECT_EQ(by_b.matches[i].b, record.matches[i].a);
  }
  const Rigid3 round = by_a.other_from_photo * by_b.other_from_photo;
  EXPECT_LT(round.translation.norm(), 1e-12);
  for (const ImageId photo : {record.a, record.b}) {
    const PairRecord back = RecordOf(MatchesFrom(record, photo), photo);
    EXPECT_EQ(back.a, record.a);
    EXPECT_EQ(back.b, record.b);
    EXPECT_EQ(back.matches, record.matches);
    EXPECT_EQ(back.lens_a.focal_px, 900);
    EXPECT_EQ(back.lens_b.focal_px, 800);
    EXPECT_LT((back.b_from_a.translation - record.b_from_a.translation).norm(), 1e-12);
    // In whatever order the matches are.
    PairMatches reversed = MatchesFrom(record, photo);
    std::ranges::reverse(reversed.matches);
    EXPECT_EQ(RecordOf(reversed, photo).matches, record.matches);
  }
}

}  // namespace
}  // namespace veduta
