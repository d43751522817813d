// SPDX-License-Identifier: Apache-2.0
// Goal: no answer tells the pose of an image that may stand elsewhere, and each says so; who has
//   lost that pose since, or has another one, is not meant.
// Method: a street of a few photos, and hypotheses that are put beside it.
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
  ImageAnswer Answer(uint32_t id) const {
    auto answer = ImageAnswerOf(*Snap(), *Snap()->GetImage(ImageId(id)));
    EXPECT_OK(answer);
    return answer.ok() ? *std::move(answer) : ImageAnswer();
  }

  City city_;
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
  const auto status = StatusOf(*Snap(), {});
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
  EXPECT_FALSE(UncertaintyOf(*Snap(), ImageId(2))->has_value());
  EXPECT_TRUE(sure.may_stand_in.empty());
  EXPECT_TRUE(sure.cam_from_world);
  EXPECT_TRUE(UncertaintyOf(*Snap(), ImageId(3))->has_value());
}

TEST_F(UnsurePosesTest, WhoHasLostItsPoseIsNotMeant) {
  Put(kOwn, kSecond, {ImageId(2)});
  const auto transaction = city_.parts().database->BeginTransaction();
  transaction->DeletePose(ImageId(2));
  ASSERT_OK(transaction->Commit());
  EXPECT_TRUE(ListUnsure(*Snap())->empty());
}

}  // namespace
}  // namespace veduta
