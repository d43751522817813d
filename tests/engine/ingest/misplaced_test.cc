// SPDX-License-Identifier: Apache-2.0
// Goal: an image on the wrong side of a seam is found, and nothing else is; where a merge is
//   refused it loses its pose, gets the right one, and what belongs together is joined, at any
//   number of threads. Whom the other side would put at the wrong one of two twins is unsure.
// Method: a synthetic scene in two reconstructions that see the same; one image of the second has a
//   wrong pose that few of its points hold, as a repeated facade would give it. And one with two
//   columns that are alike, and matches that take one for the other.
#include "engine/ingest/misplaced.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/ingest.h"
#include "engine/query/digest.h"
#include "engine/query/living.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kFirst(1), kSecond(2);
constexpr ImageId kWrong(4);

class Misplaced : public testing::Test {
 protected:
  explicit Misplaced(size_t thread_count = 1)
      : scene_({.camera_count = 8, .point_count = 2000}, thread_count) {
    scene_.AddImages(0, 8);
    scene_.AddReconstruction({0, 1, 2});
    scene_.AddReconstruction({3, 4, 5, 6, 7}, AnotherFrame());
  }

  // The image keeps 40 of its points.
  void Misplace() {
    SceneWork work(&scene_);
    std::vector<ImageId> images;
    ASSERT_OK(work.loader.LoadReconstruction(kSecond, &images));
    const std::vector<PointId> points = work.map.PointsSeenBy({&kWrong, 1});
    for (size_t i = 40; i < points.size(); ++i) work.map.RemoveObservation(points[i], kWrong);
    Rigid3 shifted = work.map.image(kWrong).cam_from_world;
    shifted.translation.x() += 0.5 * AnotherFrame().scale;
    work.map.SetPose(kWrong, shifted);
    Placement placement;
    placement.reconstruction = kSecond;
    const auto transaction = scene_.database()->BeginTransaction();
    ASSERT_OK(WritePlacementChanges(work.map, *scene_.Snap(), placement, {}, transaction.get()));
    ASSERT_OK(transaction->Commit());
  }
  SideDoubts Weigh(ReconstructionId own, ReconstructionId other, const DoubtOptions& doubt = {}) {
    SceneWork work(&scene_);
    work.options.doubt = doubt;
    std::vector<ImageId> images;
    for (uint32_t id = 1; id <= 8; ++id) images.push_back(ImageId(id));
    auto doubts = WeighSides(work.context, images, own, other);
    EXPECT_OK(doubts);
    EXPECT_TRUE(work.map.changes().poses.empty());
    return doubts.ok() ? *std::move(doubts) : SideDoubts();
  }
  std::vector<ImageId> Find(ReconstructionId own, ReconstructionId other) {
    std::vector<ImageId> found;
    for (const DoubtedImage& image : Weigh(own, other).misplaced) found.push_back(image.image);
    return found;
  }
  std::vector<ImageId> FindStronger(ReconstructionId own, ReconstructionId other,
                                    const std::vector<ImageId>& images) {
    SceneWork work(&scene_);
    const auto outweighed = FindOutweighed(work.context, images, own, other);
    EXPECT_OK(outweighed);
    EXPECT_TRUE(work.map.changes().poses.empty());
    std::vector<ImageId> found;
    for (const DoubtedImage& image : *outweighed) found.push_back(image.image);
    return found;
  }
  void ForbidPairs(ImageId image, std::initializer_list<uint32_t> others) {
    for (const uint32_t other : others) {
      ASSERT_OK(Forbid({ForbiddenKind::kPair, std::min(other, image.value),
                        std::max(other, image.value), 0, "bea", ""},
                       BeginWrite(scene_.database())));
    }
  }
  void PutHypothesis(RefusalReason reason = RefusalReason::kFewPairs) {
    HypothesisRecord hypothesis;
    hypothesis.reason = reason;
    hypothesis.contradicting_pairs = 1;
    hypothesis.a = kFirst;
    hypothesis.b = kSecond;
    hypothesis.a_from_b = AnotherFrame().Inverse();
    hypothesis.images = {ImageId(3), kWrong};
    hypothesis.is_due = true;
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    ASSERT_OK(transaction->Commit());
  }
  // Carries out what is due. A merge is refused as soon as anything is missing.
  std::vector<FollowUp> Settle() {
    Retrieval retrieval({});
    IngestOptions options;
    options.schedule.views_step = 100;
    options.mapper.doubt.missing_cells_min = 1;
    options.mapper.doubt.missing_share_max = 0.5;
    options.mapper.doubt.seam_missing_share_max = 1e-9;
    Ingest ingest(scene_.database(), &retrieval, scene_.features(), scene_.pool(), options);
    std::vector<FollowUp> done;
    while (auto step = ingest.RunNextStep()) {
      EXPECT_OK(step->status);
      done.push_back(std::move(*step));
    }
    return done;
  }

  SceneDatabase scene_;
};

TEST_F(Misplaced, NothingOfWhatIsRightIsFound) {
  EXPECT_TRUE(Find(kFirst, kSecond).empty());
  EXPECT_TRUE(Find(kSecond, kFirst).empty());
}

TEST_F(Misplaced, AnImageAtAWrongPoseIsFound) {
  Misplace();
  EXPECT_TRUE(Find(kFirst, kSecond).empty());
  EXPECT_EQ(Find(kSecond, kFirst), std::vector{kWrong});
}

TEST_F(Misplaced, WhatStandsAsWellOnEitherSideIsUnsure) {
  EXPECT_EQ(Weigh(kFirst, kSecond).unsure, (std::vector{ImageId(1), ImageId(2), ImageId(3)}));
  DoubtOptions asking_more;
  asking_more.either_side_points_min = asking_more.either_side_matches_min = 100000;
  EXPECT_TRUE(Weigh(kFirst, kSecond, asking_more).unsure.empty()) << "too little says so";
  Misplace();
  const SideDoubts doubts = Weigh(kSecond, kFirst);
  EXPECT_EQ(doubts.unsure, (std::vector{ImageId(5), ImageId(6), ImageId(7), ImageId(8)}))
      << "and the misplaced one is none of them";
}

TEST_F(Misplaced, WhoIsMatchedAcrossAsStronglyMayStandThere) {
  const size_t all = scene_.MatchesOf(4, {2, 5})[0].matches.size();
  ASSERT_GT(all, 200u);
  for (const size_t across : {all, all / 4, size_t{50}}) {
    SceneWork work(&scene_);
    work.options.doubt.either_side_points_min = 100000;  // too little is known there
    ASSERT_OK(work.loader.LoadNeighborhood(std::vector{ImageId(5)}));
    std::vector<PairMatches> pairs = scene_.MatchesOf(4, {2, 5});
    pairs[0].matches.resize(across);
    pairs[1].matches.resize(std::min(across, all / 2));
    SideDoubts doubts;
    ASSERT_OK(WeighSide(work.context, ImageId(5), pairs, kFirst, &doubts));
    EXPECT_TRUE(doubts.misplaced.empty());
    EXPECT_EQ(doubts.unsure.size(), across >= 100 ? 1u : 0u) << across;
    pairs[1].matches = scene_.MatchesOf(4, {5})[0].matches;
    pairs[0].matches.resize(std::min(across, pairs[1].matches.size() / 2));
    doubts = {};
    ASSERT_OK(WeighSide(work.context, ImageId(5), pairs, kFirst, &doubts));
    EXPECT_TRUE(doubts.unsure.empty()) << "its own side is matched more strongly";
  }
}

TEST_F(Misplaced, WhatLacksMuchWhereItIsAndHasNoOtherPlaceIsUnsure) {
  Misplace();
  ForbidPairs(kWrong, {1, 2, 3});
  const SideDoubts doubts = Weigh(kSecond, kFirst);
  EXPECT_TRUE(doubts.misplaced.empty());
  EXPECT_TRUE(std::ranges::binary_search(doubts.unsure, kWrong));
}

TEST_F(Misplaced, WhoIsHeldMoreStronglyAcrossIsFound) {
  const std::vector<ImageId> second{ImageId(4), ImageId(5), ImageId(6), ImageId(7), ImageId(8)};
  EXPECT_TRUE(FindStronger(kSecond, kFirst, second).empty()) << "3 neighbours against 4";
  // Leaves it one neighbour beside it.
  ForbidPairs(kWrong, {5, 6, 7});
  EXPECT_EQ(FindStronger(kSecond, kFirst, second), std::vector{kWrong});
  EXPECT_TRUE(FindStronger(kFirst, kSecond, second).empty()) << "none of them stands there";
  EXPECT_TRUE(FindStronger(kSecond, kFirst, {ImageId(4), ImageId(5)}).empty()) << "half of them";
  ForbidPairs(kWrong, {1, 2});
  EXPECT_TRUE(FindStronger(kSecond, kFirst, second).empty()) << "one against one";
}

TEST_F(Misplaced, WhereAllAreHeldMoreStronglyAcrossNobodyIs) {
  const std::vector<ImageId> first{ImageId(1), ImageId(2), ImageId(3)};
  EXPECT_TRUE(FindStronger(kFirst, kSecond, first).empty()) << "2 neighbours against 5, each";
}

// The first reconstruction has two columns that are alike. Images of the second are matched with it
// as photos at a twin facade are: most matches name the points of one column where they see the
// other one, and the pictures refute the place that follows.
class Lured : public testing::Test {
 protected:
  static constexpr uint32_t kInColumn = 1000;

  Lured() : scene_({.camera_count = 8, .point_count = 2 * kInColumn, .repeats = 2}) {
    scene_.AddImages(0, 8);
    scene_.AddReconstruction({0, 1, 2});
    scene_.AddReconstruction({3, 4, 5, 6, 7}, AnotherFrame());
  }

  // So many matches, at most, name the points that the camera sees.
  void Lure(uint32_t camera, size_t true_matches_max) {
    const SyntheticScene& scene = scene_.scene();
    const auto transaction = scene_.database()->BeginTransaction();
    for (const uint32_t other : {0, 1, 2}) {
      PairRecord pair = scene.Pair(other, camera);
      std::erase_if(pair.matches, [&](FeatureMatch& match) {
        const uint32_t point = scene.seen[other][match.a];
        if (point < kInColumn) return true;
        if (other == 2) return false;
        match.b = static_cast<FeatureIndex>(scene.feature_of[camera][point - kInColumn]);
        return scene.feature_of[camera][point - kInColumn] < 0;
      });
      if (other == 2) pair.matches.resize(std::min(pair.matches.size(), true_matches_max));
      if (pair.matches.empty()) {
        transaction->DeletePair(pair.a, pair.b);
      } else {
        transaction->PutPair(pair);
      }
    }
    ASSERT_OK(transaction->Commit());
  }
  std::vector<ImageId> Unsure(const std::vector<ImageId>& asked) {
    SceneWork work(&scene_);
    const auto doubts = WeighSides(work.context, asked, kSecond, kFirst);
    EXPECT_OK(doubts);
    EXPECT_TRUE(doubts->misplaced.empty());
    return doubts->unsure;
  }

  SceneDatabase scene_;
};

TEST_F(Lured, WhomMostMatchesPutAtTheTwinThereIsUnsure) {
  Lure(3, 300);
  EXPECT_EQ(std::ranges::count(Unsure({ImageId(4)}), ImageId(4)), 1);
}

TEST_F(Lured, WhomNothingPutsElsewhereThereIsSure) {
  Lure(3, 0);
  EXPECT_TRUE(Unsure({ImageId(4)}).empty());
  Lure(3, 50);
  EXPECT_TRUE(Unsure({ImageId(4)}).empty()) << "too few points";
}

TEST_F(Lured, ThoseWhoSeeTheSameAreAskedToo) {
  Lure(3, 300);
  Lure(4, 300);
  Lure(5, 0);
  EXPECT_EQ(Unsure({ImageId(4)}), (std::vector{ImageId(4), ImageId(5), ImageId(7), ImageId(8)}));
  EXPECT_TRUE(Unsure({ImageId(6)}).empty()) << "it is not lured itself";
}

TEST_F(Misplaced, WhatLacksLittleStaysWhereItIs) {
  VisibleStructure here, there;
  here.cells = 30, here.missing_cells = 3;
  there.cells = 30;
  const DoubtOptions options;
  EXPECT_TRUE(IsClearlyBetter(there, here, options));
  there.cells = options.better_cells_min - 1;
  EXPECT_FALSE(IsClearlyBetter(there, here, options)) << "too little was asked there";
  there.cells = 30, there.missing_cells = 2;
  EXPECT_FALSE(IsClearlyBetter(there, here, options)) << "something is missing there, too";
  there.missing_cells = 0, here.missing_cells = 2;
  EXPECT_FALSE(IsClearlyBetter(there, here, options)) << "hardly anything is missing here";
  here.cells = 100, here.missing_cells = 3;
  EXPECT_FALSE(IsClearlyBetter(there, here, options)) << "a small share is missing here";
}

// The same with other numbers of threads.
class Threaded final : public Misplaced {
 public:
  explicit Threaded(size_t thread_count) : Misplaced(thread_count) {}
  void TestBody() override {}

  std::string SettledDigest() {
    Misplace();
    PutHypothesis();
    Settle();
    return DigestOf(*scene_.Snap())->Hex();
  }
};

TEST_F(Misplaced, ItLosesItsPoseAndGetsTheRightOne) {
  Misplace();
  PutHypothesis();
  const auto done = Settle();
  ASSERT_GE(done.size(), 2u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kJudgment);
  ASSERT_EQ(done[0].unplaced.size(), 1u);
  EXPECT_EQ(done[0].unplaced[0].image, kWrong);
  EXPECT_TRUE(done[0].unplaced[0].detail.starts_with("in reconstruction 2, "))
      << done[0].unplaced[0].detail;
  EXPECT_EQ(done[1].kind, FollowUpKind::kPropagation);
  EXPECT_EQ(done[1].image, kWrong);
  EXPECT_FALSE(done[1].placed.empty());
  const auto living = ListLiving(*scene_.Snap());
  ASSERT_OK(living);
  ASSERT_EQ(living->size(), 1u) << "nothing speaks against the merge any more";
  const auto pose = *scene_.Snap()->FindPose(kWrong);
  const auto beside = *scene_.Snap()->FindPose(ImageId(5));
  ASSERT_TRUE(pose && beside);
  const SyntheticScene& truth = scene_.scene();
  const Rigid3 found = pose->cam_from_world * beside->cam_from_world.Inverse();
  EXPECT_LT(RotationErrorDeg(found, truth.poses[3] * truth.poses[4].Inverse()), 0.1);
  const auto violations = FindViolations(*scene_.Snap(), 9);
  ASSERT_OK(violations);
  EXPECT_TRUE(violations->empty());
}

TEST_F(Misplaced, OfWhatWasJustSplitItLosesItsPoseToo) {
  Misplace();
  PutHypothesis(RefusalReason::kSplit);
  const auto done = Settle();
  ASSERT_GE(done.size(), 2u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kJudgment);
  EXPECT_FALSE(done[0].merged_into.valid()) << "nothing new speaks for joining them";
  ASSERT_EQ(done[0].unplaced.size(), 1u);
  EXPECT_EQ(done[0].unplaced[0].image, kWrong);
  EXPECT_EQ(done[1].kind, FollowUpKind::kPropagation);
  EXPECT_FALSE(done[1].placed.empty());
}

TEST_F(Misplaced, WhatWasJustSplitStaysSo) {
  PutHypothesis(RefusalReason::kSplit);
  const auto done = Settle();
  ASSERT_EQ(done.size(), 1u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kJudgment);
  EXPECT_TRUE(done[0].unplaced.empty());
  EXPECT_EQ(ListLiving(*scene_.Snap())->size(), 2u);
  const auto hypotheses = scene_.Snap()->ListHypotheses();
  ASSERT_OK(hypotheses);
  ASSERT_EQ(hypotheses->size(), 1u);
  EXPECT_EQ(hypotheses->front().reason, RefusalReason::kSplit);
  EXPECT_EQ(hypotheses->front().judgment_count, 2u);
  EXPECT_FALSE(hypotheses->front().is_due);
}

TEST_F(Misplaced, TheDigestDoesNotDependOnThreads) {
  EXPECT_EQ(Threaded(1).SettledDigest(), Threaded(2).SettledDigest());
}

}  // namespace
}  // namespace veduta
