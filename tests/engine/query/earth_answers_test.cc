// SPDX-License-Identifier: Apache-2.0
// Goal: answers of the earth are read from one snapshot: poses by the place of their own
//   reconstruction, surveyed points where two photos see them from different sides.
// Method: three cameras in a database that look at one point, with a place that is given; the
//   point's sightings are computed, moved, and left out.
#include "engine/query/earth_answers.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"
#include "engine/earth/local_frame.h"
#include "engine/query/ground_sightings.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr ReconstructionId kHere(1), kElsewhere(2);
const Eigen::Vector3d kPoint(0.5, 0.25, 8);

CameraModel Model() {
  CameraModel model;
  model.width_px = 640;
  model.height_px = 480;
  model.fx = model.fy = 500;
  model.cx = model.u0 = 319.5;
  model.cy = model.v0 = 239.5;
  model.k1 = -0.1;
  return model;
}

Rigid3 CameraAt(double x) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0)};
}

GroundSighting SightingOf(uint32_t image, double x) {
  const auto px = PixelFromBearing(Model(), CameraAt(x) * kPoint);
  EXPECT_TRUE(px);
  const Eigen::Vector2d seen = DistortPixel(Model(), *px);
  return {ImageId(image), seen.x(), seen.y()};
}

class EarthAnswers : public testing::Test {
 protected:
  EarthAnswers() : database_(MustCreate(folder_ / "db")) {
    auto transaction = database_->BeginTransaction();
    DatabaseState state;
    state.next_image = 4;
    state.next_camera = 2;
    state.next_reconstruction = 3;
    transaction->PutState(state);
    transaction->PutCamera({CameraId(1), "c", Model(), "a test"});
    for (uint32_t id = 1; id <= 3; ++id) {
      ImageRecord image;
      image.id = ImageId(id);
      image.name = std::to_string(id);
      image.camera = CameraId(1);
      image.verdict = Verdict::kPlaced;
      image.reason = Reason::kRegistered;
      image.photo.bytes[0] = static_cast<uint8_t>(id);
      transaction->PutImage(image);
      transaction->PutPose({image.id, kHere, CameraAt(id)});
    }
    ReconstructionRecord record;
    record.id = kHere;
    record.image_count = 3;
    record.georeference.version = 5;
    EarthPlace& place = record.georeference.place.emplace();
    place.origin = {47, 15, 300};
    place.enu_from_world.scale = 2;
    transaction->PutReconstruction(record);
    record = {};
    record.id = kElsewhere;
    record.image_count = 9;
    transaction->PutReconstruction(record);
    EXPECT_OK(transaction->Commit());
  }

  // What is answered of a surveyed point with these sightings; it was surveyed 1 m to the east of
  // where the cameras see it.
  GroundPointAnswer AnswerOf(const std::vector<GroundSighting>& sightings) {
    const GeoPosition surveyed =
        LocalFrame({47, 15, 300}).ToGeo(2 * kPoint + Eigen::Vector3d(1, 0, 0));
    auto transaction = database_->BeginTransaction();
    transaction->PutGroundPoint({"corner", surveyed, 0.05, sightings});
    EXPECT_OK(transaction->Commit());
    const auto answer = GeoreferenceOf(*database_->GetSnapshot());
    EXPECT_OK(answer);
    EXPECT_EQ(answer->ground_points.size(), 1u);
    return answer->ground_points.front();
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(EarthAnswers, PosesAreThoseOfTheirReconstruction) {
  const auto snapshot = database_->GetSnapshot();
  const auto here = EarthPoseIn(*snapshot, kHere, CameraAt(3));
  ASSERT_OK(here);
  ASSERT_TRUE(*here);
  const Eigen::Vector3d enu = LocalFrame({47, 15, 300}).FromGeo((*here)->position);
  EXPECT_LT((enu - Eigen::Vector3d(6, 0, 0)).norm(), 1e-6);
  EXPECT_EQ((*here)->version, 5u);
  const PlainPose plain{{1, 0, 0, 0}, {-3, 0, 0}, {3, 0, 0}};
  const EarthPose told = **EarthPoseIn(*snapshot, kHere, plain, std::nullopt);
  EXPECT_EQ(told.position, (*here)->position);
  EXPECT_EQ(told.vertical_stddev_m, (*here)->vertical_stddev_m);
  PoseUncertainty uncertainty;
  uncertainty.covariance[5][5] = 1;
  EXPECT_GT((*EarthPoseIn(*snapshot, kHere, plain, uncertainty))->vertical_stddev_m,
            told.vertical_stddev_m);
  EXPECT_FALSE(*EarthPoseIn(*snapshot, kElsewhere, CameraAt(3)));
  EXPECT_EQ(EarthPoseIn(*snapshot, ReconstructionId(9), CameraAt(3)).status().code(),
            StatusCode::kNotFound);
  const auto answer = GeoreferenceOf(*snapshot);
  ASSERT_OK(answer);
  ASSERT_EQ(answer->reconstructions.size(), 2u);
  EXPECT_EQ(answer->reconstructions[0].reconstruction, kElsewhere);
  EXPECT_FALSE(answer->reconstructions[0].is_known);
  EXPECT_TRUE(answer->reconstructions[1].is_known);
  EXPECT_EQ(answer->reconstructions[1].version, 5u);
}

TEST_F(EarthAnswers, SurveyedPointsAreSeenThroughTheLens) {
  const GroundPointAnswer seen = AnswerOf({SightingOf(1, 1), SightingOf(2, 2), SightingOf(3, 3)});
  EXPECT_EQ(seen.reconstruction, kHere);
  EXPECT_NEAR(seen.error_m[0], -1, 1e-5);
  EXPECT_NEAR(seen.error_m[1], 0, 1e-5);
  EXPECT_NEAR(seen.error_m[2], 0, 1e-4);
  EXPECT_LT(seen.error_px, 1e-5);
  // A click that is 6 px off shows in px.
  std::vector<GroundSighting> off = {SightingOf(1, 1), SightingOf(2, 2), SightingOf(3, 3)};
  off[1].y_px += 6;
  EXPECT_GT(AnswerOf(off).error_px, 2);
}

// People click where photos stand upright; a camera may have them as they are stored.
TEST_F(EarthAnswers, SurveyedPointsAreClickedInUprightPhotos) {
  const auto transaction = database_->BeginTransaction();
  ImageRecord image = *database_->GetSnapshot()->GetImage(ImageId(2));
  image.width_px = Model().width_px;
  image.height_px = Model().height_px;
  image.orientation = 6;  // the first row is at the right
  transaction->PutImage(image);
  ASSERT_OK(transaction->Commit());
  GroundSighting clicked = SightingOf(2, 2);
  std::swap(clicked.x_px, clicked.y_px);
  clicked.x_px = Model().height_px - 1.0 - clicked.x_px;
  const GroundPointAnswer seen = AnswerOf({SightingOf(1, 1), clicked, SightingOf(3, 3)});
  EXPECT_LT(seen.error_px, 1e-5);
  EXPECT_NEAR(seen.error_m[0], -1, 1e-5);
}

TEST_F(EarthAnswers, WhatOnePhotoSeesIsNowhere) {
  EXPECT_FALSE(AnswerOf({}).reconstruction.valid());
  EXPECT_EQ(AnswerOf({}).error_px, 0);
  EXPECT_FALSE(AnswerOf({SightingOf(2, 2)}).reconstruction.valid());
  // By parallel rays.
  GroundSighting same = SightingOf(1, 1);
  same.image = ImageId(2);
  EXPECT_FALSE(AnswerOf({SightingOf(1, 1), same}).reconstruction.valid());
  EXPECT_EQ(AnswerOf({SightingOf(1, 1), same}).error_px, 0);
}

TEST_F(EarthAnswers, WhatIsSeenWithoutAPlaceIsSeen) {
  const auto transaction = database_->BeginTransaction();
  ReconstructionRecord record = *database_->GetSnapshot()->GetReconstruction(kHere);
  record.georeference.place.reset();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  const GroundPointAnswer seen = AnswerOf({SightingOf(1, 1), SightingOf(2, 2), SightingOf(3, 3)});
  EXPECT_FALSE(seen.reconstruction.valid());
  EXPECT_GT(seen.error_px, 0);
  EXPECT_LT(seen.error_px, 1e-5);
}

TEST_F(EarthAnswers, TheDeviationIsThatOfAPixel) {
  const GroundPoint point{"p", {}, 1, {SightingOf(1, 1), SightingOf(3, 3)}};
  const auto seen = SeeGroundPoints(*database_->GetSnapshot(), {&point, 1});
  ASSERT_OK(seen);
  ASSERT_EQ(seen->size(), 1u);
  EXPECT_LT((seen->front().world - kPoint).norm(), 1e-6);
  // At 8 units 1 px of 500 is 16 thousandths; the rays meet at 14 degrees.
  EXPECT_NEAR(seen->front().deviation, 0.016 / 0.24, 0.01);
}

}  // namespace
}  // namespace veduta
