// SPDX-License-Identifier: Apache-2.0
// Goal: all that is known across a seam speaks for the right similarity and against one that is
//   wrong by a window; too few pairs are not believed.
// Method: a synthetic scene stored as two reconstructions in different frames.
#include "engine/ingest/seam.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kOther(1), kOwn(2);

class Seam : public testing::Test {
 protected:
  Seam() : scene_({.camera_count = 8, .point_count = 2000}) {
    scene_.AddImages(0, 8);
    EXPECT_EQ(scene_.AddReconstruction({0, 1, 2, 3}), kOther);
    EXPECT_EQ(scene_.AddReconstruction({4, 5, 6, 7}, AnotherFrame()), kOwn);
    work_.emplace(&scene_);
    EXPECT_OK(work_->loader.LoadNeighborhood(near_));
    auto seam = FindSeam(&work_->loader, work_->map, ImageId(5), scene_.MatchesOf(4, {0, 1, 2, 3}),
                         near_, kOther);
    EXPECT_OK(seam);
    if (seam.ok()) seam_ = std::move(*seam);
  }

  SeamEvidence Judge(const Sim3& into_from_other) const {
    return JudgeSeam(work_->map, seam_, into_from_other, work_->options);
  }

  SceneDatabase scene_;
  std::optional<SceneWork> work_;
  const std::vector<ImageId> near_ = {ImageId(5), ImageId(6), ImageId(7), ImageId(8)};
  SeamArea seam_;
};

TEST_F(Seam, ListsEachPairAcrossOnce) {
  std::vector<std::pair<uint32_t, uint32_t>> wanted, listed;
  for (uint32_t a = 5; a <= 8; ++a) {
    for (uint32_t b = 1; b <= 4; ++b) wanted.push_back({a, b});
  }
  for (const SeamPair& pair : seam_.pairs) {
    listed.push_back({pair.a.value, pair.matches.other.value});
    EXPECT_EQ(work_->map.image(pair.a).reconstruction, kOwn);
    EXPECT_EQ(work_->map.image(pair.matches.other).reconstruction, kOther);
    EXPECT_EQ(pair.matches.matches.size(),
              scene_.scene().Pair(pair.matches.other.value - 1, pair.a.value - 1).matches.size());
    EXPECT_TRUE(work_->map.HasBlock(pair.matches.other));
  }
  EXPECT_EQ(listed, wanted);
  EXPECT_EQ(seam_.into, near_);
  EXPECT_EQ(seam_.other, (std::vector{ImageId(1), ImageId(2), ImageId(3), ImageId(4)}));
}

TEST_F(Seam, IsRefinedByAllThatIsSeenAcross) {
  const Sim3 about{1.002, Eigen::Quaterniond::Identity(), {0.02, 0, 0}};
  const Sim3 refined = RefineSeam(ListCrossSightings(work_->map, seam_), AnotherFrame() * about);
  EXPECT_NEAR(refined.scale, AnotherFrame().scale, 1e-4);
  EXPECT_LT((refined.translation - AnotherFrame().translation).norm(), 2e-3);
}

TEST_F(Seam, TheRightSimilarityHolds) {
  const SeamEvidence evidence = Judge(AnotherFrame());
  EXPECT_EQ(evidence.agreeing_pairs, 16u);
  EXPECT_EQ(evidence.contradicting_pairs, 0u);
  EXPECT_GT(evidence.visible.cells, 50u);
  EXPECT_LT(evidence.visible.missing_share(), 0.05);
  EXPECT_TRUE(evidence.Holds(work_->options.doubt)) << evidence.Text();
  // As the points that it was found by have it: right to some pixels.
  const Sim3 about{1.001, Eigen::Quaterniond::Identity(), {0.01, 0, 0}};
  EXPECT_TRUE(Judge(AnotherFrame() * about).Holds(work_->options.doubt));
}

TEST_F(Seam, AViewThatFewPointsCarryOverFindsItsPlaceNearBy) {
  for (SeamPair& pair : seam_.pairs) pair.matches.matches.resize(1);
  // A tenth is some ten pixels: more than missing structure is judged to.
  const auto shifted_by = [](double x) {
    return AnotherFrame() * Sim3{1, Eigen::Quaterniond::Identity(), {x, 0, 0}};
  };
  for (const double x : {0.05, 0.1, 0.2}) {
    const VisibleStructure visible = Judge(shifted_by(x)).visible;
    EXPECT_GT(visible.cells, 150u) << x;
    EXPECT_EQ(visible.missing_cells, 0u) << x;
  }
  EXPECT_GT(Judge(shifted_by(1)).visible.missing_share(), 0.8);
}

TEST_F(Seam, OneThatIsShiftedByAWindowDoesNot) {
  const Sim3 shift{1, Eigen::Quaterniond::Identity(), {1, 0, 0}};
  const SeamEvidence evidence = Judge(AnotherFrame() * shift);
  EXPECT_EQ(evidence.agreeing_pairs, 0u);
  EXPECT_EQ(evidence.contradicting_pairs, 16u);
  EXPECT_GT(evidence.visible.missing_share(), 0.8);
  // No image that counts lacks a larger share than the one that is told.
  EXPECT_GE(evidence.worst.missing_cells, work_->options.doubt.seam_view_missing_cells_min);
  EXPECT_GE(evidence.worst.missing_share(), evidence.visible.missing_share());
  EXPECT_FALSE(evidence.Holds(work_->options.doubt)) << evidence.Text();
  EXPECT_NE(evidence.Text().find("0 pairs agree, 16 contradict"), std::string::npos);
}

TEST_F(Seam, PairsAreForWhatExplainsThemAndAgainstTheRest) {
  const auto count = [&](auto pairs_that, const Sim3& into_from_other) {
    return pairs_that(work_->map, seam_, into_from_other, work_->options).size();
  };
  EXPECT_EQ(count(PairsAgainst, AnotherFrame()), 0u);
  EXPECT_EQ(count(PairsFor, AnotherFrame()), seam_.pairs.size());
  const Sim3 shift{1, Eigen::Quaterniond::Identity(), {1, 0, 0}};
  EXPECT_EQ(count(PairsAgainst, AnotherFrame() * shift), seam_.pairs.size());
  EXPECT_EQ(count(PairsFor, AnotherFrame() * shift), 0u);
}

TEST_F(Seam, PicturesSpeakAgainstWhatIsShiftedWhateverThePairsSay) {
  const auto lacks = [&](double x) {
    const Sim3 shift{1, Eigen::Quaterniond::Identity(), {x, 0, 0}};
    return AskPictures(work_->map, seam_, AnotherFrame() * shift, work_->options)
        .LacksStructure(work_->options.doubt, 0.5);
  };
  EXPECT_FALSE(lacks(0));
  EXPECT_TRUE(lacks(1));
  seam_.pairs.clear();
  EXPECT_FALSE(lacks(0));
  EXPECT_TRUE(lacks(1));
  // Where nobody is asked, nobody speaks.
  seam_.into.clear();
  EXPECT_FALSE(lacks(1));
}

TEST(SeamEvidence, PairsThatAreMixedAreJudgedByTheirShare) {
  SeamEvidence evidence;
  evidence.compared_pairs = 100;
  evidence.mixed_pairs = 10;
  EXPECT_TRUE(evidence.LacksStructure({}, 0.05));
  EXPECT_FALSE(evidence.LacksStructure({}, 0.2));
}

TEST_F(Seam, IsKnownTheBetterTheMoreIsSeenAcross) {
  const auto of_all = Judge(AnotherFrame()).jackknife_share;
  ASSERT_TRUE(of_all);
  EXPECT_GT(*of_all, 1e-5);
  EXPECT_LT(*of_all, 1e-2);
  for (SeamPair& pair : seam_.pairs) pair.matches.matches.resize(pair.matches.matches.size() / 16);
  const auto of_few = Judge(AnotherFrame()).jackknife_share;
  ASSERT_TRUE(of_few);
  EXPECT_GT(*of_few, 2 * *of_all);
}

TEST_F(Seam, OnePhotoAloneSaysNotWhereTheSidesAre) {
  std::erase_if(seam_.pairs, [&](const SeamPair& pair) { return pair.a != seam_.pairs[0].a; });
  ASSERT_GE(seam_.pairs.size(), work_->options.doubt.seam_pairs_min);
  const SeamEvidence evidence = Judge(AnotherFrame());
  EXPECT_EQ(evidence.Refusal(work_->options.doubt), RefusalReason::kUndetermined)
      << evidence.Text();
  EXPECT_NE(evidence.Text().find("without one photo nothing says where"), std::string::npos);
}

TEST_F(Seam, IsNotMeasuredWhereSomethingElseRefuses) {
  seam_.pairs.resize(1);
  EXPECT_FALSE(Judge(AnotherFrame()).jackknife_share);
}

TEST_F(Seam, OnePairIsNotEnough) {
  seam_.pairs.resize(1);
  EXPECT_EQ(Judge(AnotherFrame()).Refusal(work_->options.doubt), RefusalReason::kFewPairs);
  work_->options.doubt.seam_pairs_min = 1;
  EXPECT_EQ(Judge(AnotherFrame()).Refusal(work_->options.doubt), RefusalReason::kUndetermined);
}

TEST(SeamEvidence, EachKindOfEvidenceIsHeard) {
  const DoubtOptions options;
  SeamEvidence evidence;
  evidence.agreeing_pairs = options.seam_pairs_min;
  evidence.agreeing_matches = 1000;
  evidence.jackknife_share = options.seam_jackknife_share_max;
  evidence.visible = {.expected = 900, .found = 800, .cells = 100, .missing_cells = 10};
  EXPECT_TRUE(evidence.Holds(options));
  SeamEvidence few = evidence, contradicted = evidence, missing = evidence, vague = evidence;
  vague.jackknife_share = 1.01 * options.seam_jackknife_share_max;
  EXPECT_EQ(vague.Refusal(options), RefusalReason::kUndetermined);
  few.agreeing_pairs = options.seam_pairs_min - 1;
  EXPECT_FALSE(few.Holds(options));
  contradicted.contradicting_matches = 701;
  EXPECT_FALSE(contradicted.Holds(options));
  // More of them where both sides see each other well.
  contradicted.visible = {.expected = 900, .found = 800, .cells = 40, .missing_cells = 2};
  EXPECT_TRUE(contradicted.Holds(options));
  contradicted.visible.missing_cells = 3;
  EXPECT_FALSE(contradicted.Holds(options));
  contradicted.visible = {.expected = 900, .found = 800, .cells = 39, .missing_cells = 1};
  EXPECT_FALSE(contradicted.Holds(options));
  contradicted.visible = {.expected = 900, .found = 800, .cells = 40, .missing_cells = 2};
  contradicted.contradicting_matches = 1001;
  EXPECT_FALSE(contradicted.Holds(options));
  missing.visible.missing_cells = 60;
  EXPECT_FALSE(missing.Holds(options));
  SeamEvidence of_one = evidence;
  of_one.worst = {.expected = 90, .found = 50, .cells = 40, .missing_cells = 10};
  EXPECT_FALSE(of_one.Holds(options));
  of_one.worst.missing_cells = options.seam_view_missing_cells_min - 1;
  EXPECT_TRUE(of_one.Holds(options));
  of_one.worst = {.expected = 90, .found = 50, .cells = 60, .missing_cells = 11};
  EXPECT_TRUE(of_one.Holds(options));
  SeamEvidence mixed = evidence;
  mixed.mixed_pairs = options.seam_mixed_pairs_min;
  mixed.compared_pairs = 20 * mixed.mixed_pairs;
  EXPECT_TRUE(mixed.Holds(options));
  --mixed.compared_pairs;
  EXPECT_EQ(mixed.Refusal(options), RefusalReason::kMissingStructure);
  --mixed.mixed_pairs;
  mixed.compared_pairs = mixed.mixed_pairs;
  EXPECT_TRUE(mixed.Holds(options));
}

}  // namespace
}  // namespace veduta
