// SPDX-License-Identifier: Apache-2.0
// Goal: no answer tells the pose of an image that may stand elsewhere, and each says so; who has
//   lost that pose since, or has another one, is not meant. Whoever such images alone tie to the
//   rest, and whom a strong pair puts elsewhere, is not told either.
// Method: a street of a few photos, and hypotheses that are put beside it; records put by hand.
#include "engine/query/unsure_poses.h"

#include <gtest/gtest.h>

#include "engine/query/city_answers.h"
#include "engine/query/pose_uncertainty.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr ReconstructionId kOwn(1), kSecond(2), kThird(3);

class UnsurePosesTest : public testing::Test {
 protected:
  void SetUp() override { city_.Add(Walk(6, 0.9, 5)); }

  void Put(ReconstructionId a, ReconstructionId b, std::vector<ImageId> unsure) {
    HypothesisRecord hypothesis;
    hypothesis.a = a;
    hypothesis.b = b;
    hypothesis.images = {ImageId(1), ImageId(2), ImageId(3)};
    hypothesis.unsure = std::move(unsure);
    const auto transaction = city_.parts().database->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    ASSERT_OK(transaction->Commit());
  }
  std::shared_ptr<const Snapshot> Snap() const { return city_.parts().database->GetSnapshot(); }
  ImageAnswer Answer(uint32_t id, const Sight& sight = {}) const {
    auto answer = ImageAnswerOf(*Snap(), *Snap()->GetImage(ImageId(id)), &cache_, sight);
    EXPECT_OK(answer);
    return answer.ok() ? *std::move(answer) : ImageAnswer();
  }

  City city_;
  mutable UnsureCache cache_;
};

TEST_F(UnsurePosesTest, EachIsListedWithWhereItMayStand) {
  EXPECT_TRUE(ListUnsure(*Snap())->empty());
  Put(kOwn, kThird, {ImageId(2), ImageId(3)});
  Put(kOwn, kSecond, {ImageId(2)});
  Put(kSecond, kThird, {ImageId(1)});  // where it does not stand
  const auto unsure = ListUnsure(*Snap());
  ASSERT_OK(unsure);
  const UnsureImages expected = {{ImageId(2), {kSecond, kThird}}, {ImageId(3), {kThird}}};
  EXPECT_EQ(*unsure, expected);
  const auto status = StatusOf(*Snap(), {}, &cache_);
  ASSERT_OK(status);
  EXPECT_EQ(status->unsure, 2u);
  EXPECT_EQ(status->placed, 5u);
}

TEST_F(UnsurePosesTest, ItsPoseIsNotTold) {
  Put(kOwn, kSecond, {ImageId(2)});
  const ImageAnswer unsure = Answer(2), sure = Answer(3);
  EXPECT_EQ(unsure.may_stand_in, std::vector{kSecond});
  EXPECT_EQ(unsure.reconstruction, kOwn);
  EXPECT_FALSE(unsure.cam_from_world);
  EXPECT_FALSE(UncertaintyOf(*Snap(), ImageId(2), &cache_)->has_value());
  EXPECT_TRUE(sure.may_stand_in.empty());
  EXPECT_TRUE(sure.cam_from_world);
  EXPECT_TRUE(UncertaintyOf(*Snap(), ImageId(3), &cache_)->has_value());
}

// That it may stand elsewhere is told, for its pose is not, and not where that is.
TEST_F(UnsurePosesTest, WhoSeesOneReconstructionIsToldOfNoOther) {
  Put(kOwn, kSecond, {ImageId(2)});
  Put(kOwn, kThird, {ImageId(2)});
  const ImageAnswer answer = Answer(2, {.reconstruction = kOwn});
  EXPECT_EQ(answer.may_stand_in, std::vector{kOwn});
  EXPECT_FALSE(answer.cam_from_world);
}

TEST_F(UnsurePosesTest, WhoHasLostItsPoseIsNotMeant) {
  Put(kOwn, kSecond, {ImageId(2)});
  const auto transaction = city_.parts().database->BeginTransaction();
  transaction->DeletePose(ImageId(2));
  ASSERT_OK(transaction->Commit());
  EXPECT_TRUE(ListUnsure(*Snap())->empty());
}

// Records of a reconstruction, put into a database by hand: who shares points with whom, and which
// verified pairs there are.
class CutOffTest : public testing::Test {
 protected:
  CutOffTest() {
    auto database = MustCreate(folder_ / "db");
    database_ = std::move(database);
    transaction_ = database_->BeginTransaction();
    for (uint32_t id = 1; id <= 8; ++id) {
      ImageRecord image = SampleImage(id);
      image.verdict = Verdict::kPlaced;
      transaction_->PutImage(image);
      PoseRecord pose;
      pose.image = ImageId(id);
      pose.reconstruction = kOwn;
      transaction_->PutPose(pose);
    }
    PutUnsure({ImageId(5)});
  }

  void PutUnsure(std::vector<ImageId> images) {
    HypothesisRecord hypothesis;
    hypothesis.a = kOwn;
    hypothesis.b = kSecond;
    hypothesis.images = images;
    hypothesis.unsure = std::move(images);
    hypothesis.reason = RefusalReason::kContradicted;
    transaction_->PutHypothesis(hypothesis);
  }

  // A verified pair, of whose matches so many are points that both see.
  void Pair(uint32_t a, uint32_t b, uint32_t matches, uint32_t points) {
    PairRecord pair = SamplePair(a, b, matches);
    transaction_->PutPair(pair);
    for (uint32_t i = 0; i < points; ++i, ++next_point_) {
      for (const uint32_t id : {a, b})
        seen_[ImageId(id)].push_back({static_cast<FeatureIndex>(seen_[ImageId(id)].size()),
                                      PointId{ImageId(1), next_point_}});
    }
  }

  // Who is not told, beside image 5.
  std::vector<uint32_t> Untold() {
    for (const auto& [image, seen] : seen_) transaction_->PutObservations(image, seen);
    EXPECT_OK(transaction_->Commit());
    const auto unsure = ListUnsure(*database_->GetSnapshot());
    EXPECT_OK(unsure);
    std::vector<uint32_t> untold;
    for (const auto& [image, others] : *unsure) {
      EXPECT_EQ(others, std::vector{kSecond});
      if (image != ImageId(5)) untold.push_back(image.value);
    }
    return untold;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<Transaction> transaction_;
  std::map<ImageId, std::vector<Observation>> seen_;
  uint32_t next_point_ = 1;
};

// 1 to 4 hold each other, and 6 to 8, which 5 alone ties to them.
TEST_F(CutOffTest, WhomOnlyUnsureImagesTieToTheRestIsNotTold) {
  for (uint32_t id = 1; id < 8; ++id) Pair(id, id + 1, 200, 100);
  Pair(4, 6, 60, 30);  // weak
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{6, 7, 8}));
}

TEST_F(CutOffTest, WhoIsHeldOtherwiseIsTold) {
  for (uint32_t id = 1; id < 8; ++id) Pair(id, id + 1, 200, 100);
  Pair(4, 6, 200, 100);
  EXPECT_EQ(Untold(), std::vector<uint32_t>());
}

// 8 shares far more with 5 than with 4, which has closer images, too.
TEST_F(CutOffTest, WhomAWeakTieAloneHoldsIsNotTold) {
  for (uint32_t id = 1; id < 5; ++id) Pair(id, id + 1, 900, 800);
  Pair(4, 6, 900, 800);
  Pair(4, 7, 100, 60);
  Pair(5, 8, 800, 700);
  Pair(4, 8, 100, 60);
  EXPECT_EQ(Untold(), std::vector<uint32_t>{8}) << "7 has no closer one";
}

// 1 stands where 2 does, but its strongest pair says that it stands beside 8.
TEST_F(CutOffTest, WhomAStrongPairPutsElsewhereIsNotTold) {
  for (uint32_t id = 1; id < 8; ++id) Pair(id, id + 1, 200, 100);
  Pair(4, 6, 200, 100);
  Pair(1, 8, 300, 5);
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{1, 8})) << "of the two nobody knows which is wrong";
}

TEST_F(CutOffTest, AWeakerPairSaysNothing) {
  for (uint32_t id = 1; id < 8; ++id) Pair(id, id + 1, 200, 100);
  Pair(4, 6, 200, 100);
  Pair(1, 8, 110, 5);
  Pair(2, 7, 90, 0);
  EXPECT_EQ(Untold(), std::vector<uint32_t>());
}

// 1 and 2 hold each other.
TEST_F(CutOffTest, WhereMostAreUnsureNobodyIsTold) {
  PutUnsure({ImageId(3), ImageId(4), ImageId(5), ImageId(6), ImageId(7), ImageId(8)});
  Pair(1, 2, 200, 100);
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{1, 2, 3, 4, 6, 7, 8}));
}

TEST_F(CutOffTest, WhereFiveOfEightAreUnsureNobodyIsTold) {
  PutUnsure({ImageId(4), ImageId(5), ImageId(6), ImageId(7), ImageId(8)});
  Pair(1, 2, 200, 100);
  Pair(2, 3, 200, 100);
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{1, 2, 3, 4, 6, 7, 8}));
}

TEST_F(CutOffTest, WhereHalfAreUnsureTheOthersAreTold) {
  PutUnsure({ImageId(5), ImageId(6), ImageId(7), ImageId(8)});
  Pair(1, 2, 200, 100);
  Pair(2, 3, 200, 100);
  Pair(3, 4, 200, 100);
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{6, 7, 8}));
}

// Whose neighbours stand elsewhere: a photo of a front like many others.
class ElsewhereTest : public testing::Test {
 protected:
  // Puts images first to last as a reconstruction.
  void Place(uint32_t id, uint32_t first, uint32_t last, Transaction* transaction) {
    ReconstructionRecord record = SampleReconstruction(id, 1);
    record.merged_into = {};
    record.image_count = last - first + 1;
    transaction->PutReconstruction(record);
    for (uint32_t image = first; image <= last; ++image) {
      PoseRecord pose;
      pose.image = ImageId(image);
      pose.reconstruction = ReconstructionId(id);
      transaction->PutPose(pose);
    }
  }

  // Those that are not told where image 1 has pairs with so many images of its own reconstruction
  // and of the two others.
  UnsureImages Unsure(uint32_t beside, uint32_t elsewhere, uint32_t own_images = 5) {
    TemporaryFolder folder;
    const auto database = MustCreate(folder / "db");
    const auto transaction = database->BeginTransaction();
    Place(1, 1, own_images, transaction.get());
    Place(2, 101, 104, transaction.get());
    Place(3, 105, 108, transaction.get());
    for (uint32_t i = 0; i < beside; ++i) transaction->PutPair(SamplePair(1, 2 + i, 20));
    for (uint32_t i = 0; i < elsewhere; ++i) transaction->PutPair(SamplePair(1, 101 + i, 20));
    transaction->PutPair(SamplePair(1, 200, 20));  // which has no pose
    EXPECT_OK(transaction->Commit());
    const auto unsure = ListUnsure(*database->GetSnapshot());
    EXPECT_OK(unsure);
    return unsure.ok() ? *unsure : UnsureImages();
  }
};

TEST_F(ElsewhereTest, MostOfWhoseNeighborsStandElsewhereIsNotTold) {
  const UnsureImages expected = {{ImageId(1), {kSecond, kThird}}};
  EXPECT_EQ(Unsure(2, 5), expected);
  EXPECT_EQ(Unsure(0, 6), expected);
}

TEST_F(ElsewhereTest, WhoHasAThirdOfThemBesideIsTold) {
  EXPECT_TRUE(Unsure(3, 6).empty());
  EXPECT_TRUE(Unsure(0, 5).empty()) << "too few say nothing";
  EXPECT_TRUE(Unsure(2, 5, 65).empty()) << "a large reconstruction is not asked";
}

// Photos that verified pairs tie to a reconstruction and that have no pose in it.
class RefusedTest : public ElsewhereTest {
 protected:
  // Those that are not told where so many photos, of this reason, have a pair with image 1.
  UnsureImages Refusing(uint32_t own_images, uint32_t photos, Reason reason) {
    TemporaryFolder folder;
    const auto database = MustCreate(folder / "db");
    const auto transaction = database->BeginTransaction();
    Place(1, 1, own_images, transaction.get());
    for (uint32_t id = 1001; id <= 1000 + photos; ++id) {
      transaction->PutPair(SamplePair(1, id, 20));
      ImageRecord image = SampleImage(id);
      image.verdict = Verdict::kPostponed;
      image.reason = reason;
      transaction->PutImage(image);
    }
    DatabaseState state;
    state.counts = DatabaseCounts{.postponed = photos};
    transaction->PutState(state);
    EXPECT_OK(transaction->Commit());
    const auto unsure = ListUnsure(*database->GetSnapshot());
    EXPECT_OK(unsure);
    return unsure.ok() ? *unsure : UnsureImages();
  }
};

TEST_F(RefusedTest, WhatHasRefusedHalfAsManyIsNotTold) {
  const UnsureImages all = Refusing(13, 7, Reason::kAmbiguous);
  EXPECT_EQ(all.size(), 13u);
  EXPECT_EQ(all.begin()->second, std::vector{kOwn}) << "elsewhere in the same";
  EXPECT_EQ(Refusing(300, 151, Reason::kContradictsNeighbors).size(), 300u) << "a large one, too";
  EXPECT_EQ(Refusing(4, 6, Reason::kDoubted).size(), 4u);
  EXPECT_EQ(Refusing(4, 6, Reason::kMissingStructure).size(), 4u);
}

TEST_F(RefusedTest, FewerOrWhoDoesNotSeeItSayNothing) {
  EXPECT_TRUE(Refusing(14, 7, Reason::kAmbiguous).empty()) << "half of them";
  EXPECT_TRUE(Refusing(4, 5, Reason::kAmbiguous).empty()) << "too few say nothing";
  EXPECT_TRUE(Refusing(4, 20, Reason::kTooFewStructurePoints).empty());
  EXPECT_TRUE(Refusing(4, 20, Reason::kResectionFailed).empty());
}

TEST_F(CutOffTest, TheCacheKnowsWhatHasChanged) {
  for (uint32_t id = 1; id < 8; ++id) Pair(id, id + 1, 200, 100);
  UnsureCache cache;
  EXPECT_EQ(Untold(), (std::vector<uint32_t>{6, 7, 8}));
  const auto first = cache.Get(*database_->GetSnapshot());
  ASSERT_OK(first);
  EXPECT_EQ(**first, *ListUnsure(*database_->GetSnapshot()));
  EXPECT_EQ(*cache.Get(*database_->GetSnapshot()), *first) << "nothing has changed";
  const auto before = *cache.Get(*database_->GetSnapshot());
  transaction_ = database_->BeginTransaction();
  DatabaseState state = *database_->GetSnapshot()->GetState();
  state.pending_propagation = {ImageId(9)};
  transaction_->PutState(state);
  ASSERT_OK(transaction_->Commit());
  EXPECT_NE(*cache.Get(*database_->GetSnapshot()), before) << "another photo is tried again";
  transaction_ = database_->BeginTransaction();
  HypothesisRecord hypothesis = database_->GetSnapshot()->ListHypotheses()->front();
  hypothesis.unsure.clear();
  transaction_->PutHypothesis(hypothesis);
  ASSERT_OK(transaction_->Commit());
  EXPECT_TRUE((*cache.Get(*database_->GetSnapshot()))->empty());
}

}  // namespace
}  // namespace veduta
