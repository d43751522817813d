// SPDX-License-Identifier: Apache-2.0
// Goal: what is stored of merges that are not believed follows what the steps of ingest do: it is
//   opened once, replaced when it is judged anew, goes with the merge, with what is forbidden and
//   with its reconstructions, and goes over where one of them becomes part of a third.
// Method: placements that are made up, over a database with four small reconstructions of one
//   synthetic scene.
#include "engine/ingest/hypotheses.h"

#include <gtest/gtest.h>

#include "engine/ingest/forbidding.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kFirst(1), kSecond(2), kThird(3), kFourth(4);

HypothesisRecord Merged(ReconstructionId a, ReconstructionId b, const Sim3& a_from_b = {}) {
  HypothesisRecord hypothesis;
  hypothesis.a = a;
  hypothesis.b = b;
  hypothesis.a_from_b = a_from_b;
  hypothesis.common_point_count = 25;
  hypothesis.image = ImageId(3);
  hypothesis.images = {ImageId(2), ImageId(3)};
  return hypothesis;
}

class Hypotheses : public testing::Test {
 protected:
  Hypotheses() : scene_({.camera_count = 12, .point_count = 300}) {
    scene_.AddImages(0, 12);
    for (uint32_t first = 0; first < 12; first += 3)
      scene_.AddReconstruction({first, first + 1, first + 2});
  }

  // What a photo that got a pose in `reconstruction` says of hypotheses, in a commit.
  void Write(Placement placement) {
    const WriteScope scope = BeginWrite(scene_.database());
    DatabaseState state = scene_.State();
    ASSERT_OK(WriteHypotheses(*scope.base, placement, &state, scope.transaction.get()));
    scope.transaction->PutState(state);
    ASSERT_OK(scope.transaction->Commit());
  }
  static Placement Refused(ReconstructionId reconstruction, std::vector<HypothesisRecord> refused) {
    Placement placement;
    placement.verdict = Verdict::kPlaced;
    placement.reconstruction = reconstruction;
    placement.refused = std::move(refused);
    return placement;
  }
  static Placement MergedInto(ReconstructionId into, ReconstructionId from, const Sim3& into_from) {
    Placement placement;
    placement.verdict = Verdict::kMerged;
    placement.reconstruction = into;
    placement.merges = {{from, into_from, 25, ""}};
    return placement;
  }
  void Open(ReconstructionId a, ReconstructionId b, const Sim3& a_from_b = {}) {
    Write(Refused(a, {Merged(a, b, a_from_b)}));
  }

  std::vector<HypothesisRecord> All() {
    auto all = scene_.Snap()->ListHypotheses();
    EXPECT_OK(all);
    return all.ok() ? *all : std::vector<HypothesisRecord>();
  }
  size_t CountEntries() {
    size_t count = 0;
    EXPECT_OK(scene_.Snap()->ScanJournal(1, [&](const JournalRecord& entry) {
      count += entry.action == "hypothesis";
      return true;
    }));
    return count;
  }
  template <typename Change>
  void Commit(const Change& change) {
    const WriteScope scope = BeginWrite(scene_.database());
    ASSERT_OK(change(*scope.base, scope.transaction.get()));
    ASSERT_OK(scope.transaction->Commit());
  }

  SceneDatabase scene_;
};

TEST(GoOver, CarriesTheFrameOfEitherSide) {
  const Sim3 into_from = AnotherFrame();
  const Sim3 a_from_b{
      2, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())), {1, -2, 3}};
  const Eigen::Vector3d x_b(0.3, 0.4, 0.5);
  const Eigen::Vector3d x_a = a_from_b * x_b;
  HypothesisRecord of_a = Merged(kSecond, kThird, a_from_b), of_b = of_a, of_neither = of_a;
  GoOver({kSecond, into_from, 0, ""}, kFourth, &of_a);
  EXPECT_EQ(of_a.a, kThird);
  EXPECT_EQ(of_a.b, kFourth);
  EXPECT_LT((of_a.a_from_b * (into_from * x_a) - x_b).norm(), 1e-12);
  GoOver({kThird, into_from, 0, ""}, kFirst, &of_b);
  EXPECT_EQ(of_b.a, kFirst);
  EXPECT_EQ(of_b.b, kSecond);
  EXPECT_LT((of_b.a_from_b * x_a - into_from * x_b).norm(), 1e-12);
  GoOver({kFirst, into_from, 0, ""}, kFourth, &of_neither);
  EXPECT_EQ(of_neither.a, kSecond);
  EXPECT_EQ(of_neither.b, kThird);
}

TEST_F(Hypotheses, OneOfASplitWaitsForMoreThanAPhotoBesideIt) {
  for (const RefusalReason reason : {RefusalReason::kFewPairs, RefusalReason::kSplit}) {
    Commit([&](const Snapshot& base, Transaction* transaction) {
      DatabaseState state = *base.GetState();
      HypothesisRecord hypothesis = Merged(kFirst, kSecond);
      hypothesis.reason = reason;
      PutNewHypothesis(std::move(hypothesis), &state, transaction);
      transaction->PutState(state);
      return Status::Ok();
    });
    ASSERT_EQ(All().size(), 1u);
    EXPECT_FALSE(All()[0].is_due);
    EXPECT_GT(All()[0].time_unix_s, 0);
    Placement beside = Refused(kFirst, {});
    beside.around = {ImageId(3)};
    Write(beside);
    EXPECT_EQ(All()[0].is_due, reason != RefusalReason::kSplit);
  }
  EXPECT_EQ(CountEntries(), 2u);
  Placement grown = Refused(kFirst, {});
  grown.known = {{kFirst, kSecond, true}};
  Write(grown);
  EXPECT_TRUE(All()[0].is_due) << "a search has found a quarter more pairs";
}

TEST_F(Hypotheses, OneIsOpenedOnceAndReplacedWhenJudgedAnew) {
  Open(kFirst, kSecond);
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].judgment_count, 1u);
  EXPECT_FALSE(All()[0].is_due);
  EXPECT_GT(All()[0].time_unix_s, 0);
  EXPECT_EQ(CountEntries(), 1u);
  HypothesisRecord again = Merged(kFirst, kSecond);
  again.image = ImageId(7);
  again.images = {ImageId(6), ImageId(7)};
  again.agreeing_pairs = 5;
  again.reason = RefusalReason::kContradicted;
  Write(Refused(kSecond, {again}));
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].judgment_count, 2u);
  EXPECT_EQ(All()[0].agreeing_pairs, 5u);
  EXPECT_EQ(All()[0].reason, RefusalReason::kContradicted);
  EXPECT_EQ(All()[0].images, again.images);
  EXPECT_EQ(All()[0].image, ImageId(3)) << "the photo that proposed it first";
  EXPECT_EQ(CountEntries(), 1u);
  EXPECT_TRUE(FindViolations(*scene_.Snap(), 9)->empty());
}

TEST_F(Hypotheses, WhoIsTiedToAnUnsureImageIsUnsure) {
  HypothesisRecord first = Merged(kFirst, kSecond);
  first.reason = RefusalReason::kMissingStructure;
  first.unsure = {ImageId(2)};
  Write(Refused(kFirst, {first}));
  Placement photo = Refused(kFirst, {});
  photo.placed = {ImageId(1)};
  photo.strongest = ImageId(3);
  Write(photo);
  EXPECT_EQ(All()[0].unsure, std::vector{ImageId(2)});
  photo.strongest = ImageId(2);
  Placement elsewhere = photo;
  elsewhere.reconstruction = kThird;
  Write(elsewhere);
  EXPECT_EQ(All()[0].unsure, std::vector{ImageId(2)});
  Write(photo);
  EXPECT_EQ(All()[0].unsure, (std::vector{ImageId(1), ImageId(2)}));
  EXPECT_EQ(All()[0].images, (std::vector{ImageId(1), ImageId(2), ImageId(3)}));
  EXPECT_TRUE(FindViolations(*scene_.Snap(), 9)->empty());
}

TEST_F(Hypotheses, APhotoAddsToTheUnsureAndAJudgmentNamesThemAnew) {
  HypothesisRecord first = Merged(kFirst, kSecond);
  first.reason = RefusalReason::kContradicted;
  first.unsure = {ImageId(2)};
  Write(Refused(kFirst, {first}));
  EXPECT_EQ(All()[0].unsure, std::vector{ImageId(2)});
  HypothesisRecord seen = first;
  seen.images = {ImageId(2), ImageId(3), ImageId(4)};
  seen.unsure = {ImageId(4)};
  Placement photo = Refused(kFirst, {seen});
  photo.placed = {ImageId(3)};
  Write(photo);
  EXPECT_EQ(All()[0].unsure, (std::vector{ImageId(2), ImageId(4)}));
  // A search that leads to a large seam names only those that it has weighed.
  Placement known = Refused(kFirst, {});
  known.placed = {ImageId(1)};
  known.known = {{kFirst, kSecond, false, RefusalReason::kContradicted, {ImageId(1), ImageId(4)}}};
  Write(known);
  EXPECT_EQ(All()[0].unsure, (std::vector{ImageId(1), ImageId(2), ImageId(4)}));
  EXPECT_EQ(All()[0].images, (std::vector{ImageId(1), ImageId(2), ImageId(3), ImageId(4)}));
  EXPECT_FALSE(All()[0].is_due);
  photo.refused[0].images = {ImageId(3), ImageId(4)};  // the seam lies elsewhere now
  Write(photo);
  EXPECT_EQ(All()[0].unsure, std::vector{ImageId(4)});
  Write(Refused(kFirst, {Merged(kFirst, kSecond)}));
  EXPECT_TRUE(All()[0].unsure.empty()) << "the judgment has found none";
  EXPECT_TRUE(FindViolations(*scene_.Snap(), 9)->empty());
}

TEST_F(Hypotheses, TheMergeEndsItAndThoseOfOthersGoOver) {
  const Sim3 second_from_third = AnotherFrame();
  Open(kFirst, kSecond);
  Open(kSecond, kThird, second_from_third);
  Open(kFirst, kFourth);
  HypothesisRecord contradicted = Merged(kThird, kFourth);
  contradicted.reason = RefusalReason::kContradicted;
  Write(Refused(kThird, {contradicted}));
  const Sim3 first_from_second{3, Eigen::Quaterniond::Identity(), {1, 2, 3}};
  Write(MergedInto(kFirst, kSecond, first_from_second));
  const std::vector<HypothesisRecord> all = All();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].a, kFirst);
  EXPECT_EQ(all[0].b, kThird);
  EXPECT_TRUE(all[0].is_due) << "it is of the whole now";
  const Eigen::Vector3d x(1, 2, 3);
  EXPECT_LT((all[0].a_from_b * x - first_from_second * (second_from_third * x)).norm(), 1e-12);
  EXPECT_EQ(all[1].b, kFourth);
  EXPECT_TRUE(all[1].is_due) << "what the first took in has pairs with it";
  EXPECT_EQ(all[2].a, kThird);
  EXPECT_FALSE(all[2].is_due) << "neither of its two was touched";
}

TEST_F(Hypotheses, AMergeSaysNothingOfThoseThatWhatCameHasNoPairsWith) {
  Open(kFirst, kFourth);
  Commit([](const Snapshot& base, Transaction* transaction) {
    for (uint32_t image = 4; image <= 6; ++image) {
      for (uint32_t other = 10; other <= 12; ++other)
        transaction->DeletePair(ImageId(image), ImageId(other));
    }
    return Status::Ok();
  });
  Write(MergedInto(kFirst, kSecond, {}));
  ASSERT_EQ(All().size(), 1u);
  EXPECT_FALSE(All()[0].is_due);
}

TEST_F(Hypotheses, OneThatGoesOverToAKnownOneMakesThatDue) {
  Open(kFirst, kThird);
  Open(kSecond, kThird);
  Write(MergedInto(kFirst, kSecond, {}));
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].b, kThird);
  EXPECT_TRUE(All()[0].is_due);
}

TEST_F(Hypotheses, WhatIsOpenTakesNoVotesAway) {
  Open(kFirst, kSecond, AnotherFrame());
  HypothesisRecord open = Merged(kFirst, kSecond);
  open.reason = RefusalReason::kOpen;
  open.common_point_count = 0;
  open.images = {ImageId(1), ImageId(4)};
  Write(Refused(kFirst, {open}));
  EXPECT_EQ(All()[0].reason, RefusalReason::kFewPairs);
  EXPECT_EQ(All()[0].common_point_count, 25u);
  EXPECT_EQ(All()[0].a_from_b.scale, AnotherFrame().scale);
  EXPECT_EQ(All()[0].images, (std::vector{ImageId(1), ImageId(2), ImageId(3), ImageId(4)}))
      << "a loop may stand on all of them";
}

TEST_F(Hypotheses, TwoThatBecomeOneKeepTheImagesOfBothAndWhatIsKnown) {
  HypothesisRecord open = Merged(kFirst, kThird);
  open.reason = RefusalReason::kOpen;
  open.images = {ImageId(1), ImageId(9)};
  Write(Refused(kFirst, {open}));
  Open(kSecond, kThird, AnotherFrame());
  Write(MergedInto(kFirst, kSecond, {}));
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].reason, RefusalReason::kFewPairs);
  EXPECT_EQ(All()[0].a_from_b.scale, AnotherFrame().scale);
  EXPECT_EQ(All()[0].images, (std::vector{ImageId(1), ImageId(2), ImageId(3), ImageId(9)}));
  EXPECT_TRUE(FindViolations(*scene_.Snap(), 9)->empty());
}

TEST_F(Hypotheses, ALoopThatHasGrownMakesItsSeamsDue) {
  Open(kFirst, kSecond);
  Open(kSecond, kThird);
  EXPECT_FALSE(All()[0].is_due);
  Placement closing = Refused(kFirst, {Merged(kFirst, kThird)});
  closing.placed = {ImageId(1)};
  Write(closing);
  ASSERT_EQ(All().size(), 3u);
  for (const HypothesisRecord& hypothesis : All()) EXPECT_TRUE(hypothesis.is_due);
  // Judged with this loop, it waits until the loop has grown, also where nothing followed.
  HypothesisRecord judged = Merged(kFirst, kSecond);
  judged.reason = RefusalReason::kOpen;
  Write(Refused(kFirst, {judged}));
  EXPECT_FALSE(All()[0].is_due);
  EXPECT_EQ(All()[0].loop_images, 6u) << "two at each of the three seams";
  HypothesisRecord grown = Merged(kFirst, kThird);
  Placement photo = Refused(kFirst, {grown});
  photo.placed = {ImageId(1)};
  photo.refused[0].images = {ImageId(1), ImageId(2), ImageId(3)};
  Write(photo);
  EXPECT_FALSE(All()[0].is_due) << "by one image of six";
  photo.refused[0].images = {ImageId(2), ImageId(3), ImageId(7)};
  Write(photo);
  EXPECT_TRUE(All()[0].is_due);
}

TEST_F(Hypotheses, WhatPeopleForbidIsNone) {
  Open(kFirst, kSecond);
  Open(kFirst, kFourth);
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, 2, 1, 0, "bea", ""}, BeginWrite(scene_.database())));
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].b, kFourth);
  // The third may not be joined with the fourth, and becomes part of the first.
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, 3, 4, 0, "bea", ""}, BeginWrite(scene_.database())));
  EXPECT_EQ(All().size(), 1u);
  Placement placement = MergedInto(kFirst, kThird, {});
  placement.refused = {Merged(kFirst, kFourth)};
  Write(placement);
  EXPECT_TRUE(All().empty());
}

TEST_F(Hypotheses, AForbiddenPairAcrossMakesItDue) {
  Open(kFirst, kSecond);
  Open(kFirst, kThird);
  ASSERT_OK(Forbid({ForbiddenKind::kPair, 1, 5, 0, "bea", ""}, BeginWrite(scene_.database())));
  EXPECT_TRUE(All()[0].is_due);
  EXPECT_FALSE(All()[1].is_due);
}

TEST_F(Hypotheses, APhotoAtTheSeamMakesItDueUnlessItJudgesIt) {
  Open(kFirst, kSecond);
  Open(kFirst, kThird);
  Placement elsewhere = Refused(kFirst, {});
  elsewhere.around = {ImageId(1), ImageId(12)};
  Write(elsewhere);
  EXPECT_FALSE(All()[0].is_due || All()[1].is_due) << "nothing at the seam has changed";
  Placement of_another = Refused(kFourth, {});
  of_another.around = {ImageId(2)};
  Write(of_another);
  EXPECT_FALSE(All()[0].is_due || All()[1].is_due) << "it was placed in neither of the two";
  Placement at_seam = Refused(kFirst, {Merged(kFirst, kSecond)});
  at_seam.around = {ImageId(9), ImageId(2)};
  Write(at_seam);
  EXPECT_FALSE(All()[0].is_due);
  EXPECT_TRUE(All()[1].is_due);
  Write(Refused(kFirst, {Merged(kFirst, kThird)}));
  EXPECT_FALSE(All()[1].is_due) << "it was judged";
}

TEST_F(Hypotheses, AWholeReconstructionMakesAllOfItDueOrDropsThem) {
  Open(kFirst, kSecond);
  Open(kSecond, kThird);
  Open(kThird, kFourth);
  Commit([](const Snapshot& base, Transaction* to) {
    return MakeHypothesesDue(base, kSecond, {}, Splits::kMeant, to);
  });
  EXPECT_TRUE(All()[0].is_due && All()[1].is_due);
  EXPECT_FALSE(All()[2].is_due);
  Commit([](const Snapshot& base, Transaction* to) { return DropHypotheses(base, kThird, to); });
  ASSERT_EQ(All().size(), 1u);
  EXPECT_EQ(All()[0].b, kSecond);
}

TEST_F(Hypotheses, ThatOfASplitIsPassedOverWhereNothingIsNew) {
  Open(kFirst, kSecond);
  Open(kSecond, kThird);
  Commit([&](const Snapshot&, Transaction* to) {
    HypothesisRecord split = All()[0];
    split.reason = RefusalReason::kSplit;
    to->PutHypothesis(split);
    return Status::Ok();
  });
  const auto make_due = [&](Splits splits) {
    Commit([&](const Snapshot& base, Transaction* to) {
      return MakeHypothesesDue(base, kSecond, {}, splits, to);
    });
  };
  make_due(Splits::kPassedOver);
  EXPECT_FALSE(All()[0].is_due);
  EXPECT_TRUE(All()[1].is_due);
  make_due(Splits::kMeant);
  EXPECT_TRUE(All()[0].is_due);
}

TEST_F(Hypotheses, ARemovedImageIsNamedByNone) {
  HypothesisRecord hypothesis = Merged(kFirst, kSecond);
  hypothesis.unsure = hypothesis.images;
  Write(Refused(kFirst, {hypothesis}));
  const auto forget = [&](uint32_t image) {
    Commit([&](const Snapshot& base, Transaction* to) {
      return ForgetInHypotheses(base, ImageId(image), to);
    });
  };
  forget(5);
  EXPECT_FALSE(All()[0].is_due) << "it does not name the image";
  forget(3);
  ASSERT_EQ(All().size(), 1u);
  EXPECT_FALSE(All()[0].image.valid());
  EXPECT_EQ(All()[0].images, std::vector{ImageId(2)});
  EXPECT_EQ(All()[0].unsure, std::vector{ImageId(2)});
  EXPECT_TRUE(All()[0].is_due);
  forget(2);
  EXPECT_TRUE(All().empty());
}

TEST_F(Hypotheses, VerifyNoticesOneThatOutlivesWhatItIsOf) {
  const auto is_noticed = [&](HypothesisRecord hypothesis, const std::string& word) {
    auto transaction = scene_.database()->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    ASSERT_OK(transaction->Commit());
    const auto violations = FindViolations(*scene_.Snap(), 9);
    ASSERT_OK(violations);
    ASSERT_EQ(violations->size(), 1u);
    EXPECT_NE(violations->front().find(word), std::string::npos) << violations->front();
    transaction = scene_.database()->BeginTransaction();
    transaction->DeleteHypothesis(hypothesis.a, hypothesis.b);
    ASSERT_OK(transaction->Commit());
  };
  is_noticed(Merged(kFirst, ReconstructionId(9)), "does not live");
  HypothesisRecord names_none = Merged(kFirst, kSecond);
  names_none.images.push_back(ImageId(99));
  is_noticed(names_none, "does not exist");
  names_none = Merged(kFirst, kSecond);
  names_none.image = ImageId(99);
  is_noticed(names_none, "does not exist");
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, 1, 2, 0, "bea", ""}, BeginWrite(scene_.database())));
  is_noticed(Merged(kFirst, kSecond), "forbidden");
}

}  // namespace
}  // namespace veduta
