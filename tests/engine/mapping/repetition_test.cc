// SPDX-License-Identifier: Apache-2.0
// Goal: views that show the same thing again and again are told from others, by all their pairs.
// Method: synthetic scenes of columns that are all alike, or all different.
#include "engine/mapping/repetition.h"

#include <gtest/gtest.h>

#include "scene_checks.h"

namespace veduta {
namespace {

struct Views {
  std::vector<MapImage> images;
  std::vector<PairRecord> pairs;
};

Views MakeViews(uint32_t repeats, bool planar) {
  SceneOptions options;
  options.repeats = repeats;
  options.planar = planar;
  const SyntheticScene scene = MakeScene(options);
  Views views;
  for (uint32_t i = 0; i < 4; ++i) {
    views.images.push_back(Unplaced(scene.images[i]));
    for (uint32_t j = i + 1; j < 4; ++j) views.pairs.push_back(scene.Pair(i, j));
  }
  return views;
}

double ShareOf(const Views& views, const RepetitionOptions& options = {}) {
  return RepeatedShare(views.images, views.pairs, options);
}

TEST(Repetition, AFrontOfColumnsThatAreAlikeIsTold) {
  EXPECT_GT(ShareOf(MakeViews(6, true)), 0.2);
  EXPECT_LT(ShareOf(MakeViews(1, true)), 0.02);
}

TEST(Repetition, AlsoWhereThingsStandBeforeTheFront) {
  EXPECT_GT(ShareOf(MakeViews(6, false)), 0.2);
  EXPECT_LT(ShareOf(MakeViews(1, false)), 0.02);
}

TEST(Repetition, WhatIsLessAlikeThanAskedIsNoRival) {
  const Views views = MakeViews(6, true);
  // The descriptors of two views of one column differ as much as those of two columns.
  EXPECT_LT(ShareOf(views, {.distance_squared_max = 1}), 0.01);
  EXPECT_LT(ShareOf(views, {.apart_px = 2000}), 0.01);
  EXPECT_LT(ShareOf(views, {.alike_count_max = 1}), 0.02);
}

TEST(Repetition, WithoutPairsOrMatchesThereIsNone) {
  Views views = MakeViews(6, true);
  for (PairRecord& pair : views.pairs) pair.matches.clear();
  EXPECT_EQ(ShareOf(views), 0);
  views.pairs.clear();
  EXPECT_EQ(ShareOf(views), 0);
  EXPECT_EQ(RepeatedShare({}, {}, {}), 0);
}

TEST(Repetition, ThePairsWithMostMatchesAreAsked) {
  Views views = MakeViews(6, true);
  const Views others = MakeViews(1, true);
  for (PairRecord& pair : views.pairs) pair.matches.resize(30);
  views.images[0] = others.images[0];
  views.images[1] = others.images[1];
  views.pairs[0] = others.pairs[0];  // of images 1 and 2
  EXPECT_LT(ShareOf(views, {.pair_count_max = 1}), 0.02);
}

TEST(Repetition, WhatIsRememberedChangesNothing) {
  RepetitionMemory memory(100);
  Views views = MakeViews(6, true);
  const double share = ShareOf(views);
  EXPECT_EQ(RepeatedShare(views.images, views.pairs, {}, &memory), share);
  EXPECT_EQ(RepeatedShare(views.images, views.pairs, {}, &memory), share);
  // Other matches of the same images are another pair.
  const Views others = MakeViews(1, true);
  EXPECT_EQ(RepeatedShare(others.images, others.pairs, {}, &memory), ShareOf(others));
  // So are fewer of them.
  for (PairRecord& pair : views.pairs) pair.matches.resize(30);
  EXPECT_EQ(RepeatedShare(views.images, views.pairs, {}, &memory), ShareOf(views));
}

TEST(Repetition, OptionsOutOfBoundsAreNamed) {
  EXPECT_TRUE(RepetitionOptions().Check().ok());
  RepetitionOptions options;
  options.rival_distance_factor = 0.9;
  EXPECT_NE(options.Check().message().find("rival_distance_factor"), std::string::npos);
}

}  // namespace
}  // namespace veduta
