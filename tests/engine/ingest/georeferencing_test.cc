// SPDX-License-Identifier: Apache-2.0
// Goal: the place of a reconstruction is looked for when it should be and not more often; a look
//   writes a place, or that there is none any more, in one commit, and nothing where another one
//   came first.
// Method: records with other counts; a synthetic scene in a database whose images tell where they
//   were taken, in a frame that is known.
#include "engine/ingest/georeferencing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/camera/orientation.h"
#include "engine/earth/earth_pose.h"
#include "engine/earth/local_frame.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

const GeoPosition kOrigin{47.07, 15.44, 350};

ReconstructionRecord Looked(uint32_t images, uint32_t images_at_look, uint32_t at_adjustment = 7) {
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  record.image_count = images;
  record.images_at_adjustment = 7;
  record.georeference.images_at_look = images_at_look;
  record.georeference.images_at_adjustment = at_adjustment;
  return record;
}

TEST(Georeferencing, IsLookedForWhenSomethingHasChanged) {
  EXPECT_TRUE(IsLookDue(Looked(3, 0, 0), true));
  EXPECT_FALSE(IsLookDue(Looked(3, 0, 0), false));
  EXPECT_FALSE(IsLookDue(Looked(100, 100), true));
  EXPECT_FALSE(IsLookDue(Looked(110, 100), true));
  EXPECT_TRUE(IsLookDue(Looked(111, 100), true));
  EXPECT_TRUE(IsLookDue(Looked(99, 100), true)) << "it has lost one";
  EXPECT_TRUE(IsLookDue(Looked(100, 100, 6), true)) << "it was adjusted";
  EXPECT_TRUE(IsLookDue(Looked(100, 100), false)) << "nothing tells any more";
  ReconstructionRecord gone = Looked(3, 0, 0);
  gone.is_dissolved = true;
  EXPECT_FALSE(IsLookDue(gone, true));
  gone.is_dissolved = false;
  gone.merged_into = ReconstructionId(2);
  EXPECT_FALSE(IsLookDue(gone, true));
}

// Images 1 to `count` of the scene, placed, of which those up to `told` tell where they are.
void Prepare(SceneDatabase* scene, uint32_t count, uint32_t told) {
  scene->AddImages(0, count);
  std::vector<uint32_t> all;
  for (uint32_t k = 0; k < count; ++k) all.push_back(k);
  scene->AddReconstruction(all);
  const auto transaction = scene->database()->BeginTransaction();
  for (uint32_t id = 1; id <= told; ++id) {
    ImageRecord image = *scene->Snap()->GetImage(ImageId(id));
    const auto pose = *scene->Snap()->FindPose(ImageId(id));
    const GeoPosition there = LocalFrame(kOrigin).ToGeo(40 * pose->cam_from_world.Center());
    image.gps = GpsFix{there.latitude_deg, there.longitude_deg, there.height_m, 0.5, {}};
    transaction->PutImage(image);
  }
  ASSERT_OK(transaction->Commit());
}

ReconstructionRecord RecordOf(const SceneDatabase& scene) {
  return *scene.Snap()->GetReconstruction(ReconstructionId(1));
}

Status Look(SceneDatabase* scene) {
  return LookForPlace(ReconstructionId(1), BeginWrite(scene->database()));
}

TEST(Georeferencing, WhatWasRefusedForThePlaceIsJudgedAnew) {
  SceneDatabase scene;
  Prepare(&scene, 6, 6);
  const auto transaction = scene.database()->BeginTransaction();
  for (const auto& [b, reason] :
       {std::pair(2u, RefusalReason::kFarApart), std::pair(3u, RefusalReason::kContradicted)}) {
    HypothesisRecord hypothesis;
    hypothesis.a = ReconstructionId(1);
    hypothesis.b = ReconstructionId(b);
    hypothesis.reason = reason;
    hypothesis.images = {ImageId(1)};
    transaction->PutHypothesis(hypothesis);
  }
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(Look(&scene));
  const auto all = scene.Snap()->ListHypotheses();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 2u);
  EXPECT_TRUE((*all)[0].is_due);
  EXPECT_FALSE((*all)[1].is_due);
}

TEST(Georeferencing, CompassesCount) {
  double deviation_deg[2] = {0, 0};
  Eigen::Matrix3d enu_from_world;  // the cameras look to the north
  enu_from_world << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  for (const bool has_compass : {false, true}) {
    SceneDatabase scene;
    Prepare(&scene, 6, 6);
    const auto transaction = scene.database()->BeginTransaction();
    for (uint32_t id = 1; id <= 6; ++id) {
      ImageRecord image = *scene.Snap()->GetImage(ImageId(id));
      const auto pose = *scene.Snap()->FindPose(ImageId(id));
      const GeoPosition there =
          LocalFrame(kOrigin).ToGeo(40 * enu_from_world * pose->cam_from_world.Center());
      image.gps = GpsFix{there.latitude_deg, there.longitude_deg, there.height_m, 50, {}};
      const Eigen::Vector3d forward =
          enu_from_world * (pose->cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
      const double heading_deg = std::atan2(forward.x(), forward.y()) * 180 / std::numbers::pi;
      if (has_compass) image.gps->heading_deg = std::fmod(heading_deg + 360, 360);
      transaction->PutImage(image);
    }
    ASSERT_OK(transaction->Commit());
    ASSERT_OK(Look(&scene));
    const Georeference told = RecordOf(scene).georeference;
    ASSERT_TRUE(told.place);
    deviation_deg[has_compass] = EarthAnswerOf(told).heading_stddev_deg;
  }
  EXPECT_GT(deviation_deg[true], 1);
  EXPECT_LT(deviation_deg[true], 0.9 * deviation_deg[false]);
}

TEST(Georeferencing, ALookFindsThePlace) {
  SceneDatabase scene;
  Prepare(&scene, 6, 6);
  EXPECT_TRUE(*IsPlaceTold(*scene.Snap(), scene.State()));
  EXPECT_TRUE(IsLookDue(RecordOf(scene), true));
  const ReconstructionRecord before = RecordOf(scene);
  ASSERT_OK(Look(&scene));
  const ReconstructionRecord after = RecordOf(scene);
  EXPECT_FALSE(IsLookDue(after, true));
  EXPECT_EQ(after.geometry_version, before.geometry_version) << "its frame stays";
  ASSERT_TRUE(after.georeference.place);
  const EarthPlace& place = *after.georeference.place;
  EXPECT_EQ(after.georeference.version, 1u);
  EXPECT_EQ(place.fixes.used, 6u);
  EXPECT_EQ(place.fixes.agreeing, 6u);
  EXPECT_NEAR(place.enu_from_world.scale, 40, 1);
  EXPECT_TRUE(FindViolations(*scene.Snap(), 9)->empty());
  // Looked for again, it has the next version and the same origin.
  ASSERT_OK(Look(&scene));
  EXPECT_EQ(RecordOf(scene).georeference.version, 2u);
  EXPECT_EQ(RecordOf(scene).georeference.place->origin, place.origin);
}

// The cameras' centres alone tell little of the tilt here: people's habit to hold photos upright
// tells the rest, and an upright photo that its camera has lying says the same.
TEST(Georeferencing, PhotosThatCamerasHaveLyingAreHeldUpright) {
  SceneDatabase upright, lying;
  for (SceneDatabase* scene : {&upright, &lying}) {
    Prepare(scene, 6, 6);
    const auto transaction = scene->database()->BeginTransaction();
    for (uint32_t id = 1; id <= 6 && scene == &lying; ++id) {
      ImageRecord image = *scene->Snap()->GetImage(ImageId(id));
      image.orientation = 6;
      transaction->PutImage(image);
      PoseRecord pose = *scene->Snap()->FindPose(ImageId(id)).value();
      pose.cam_from_world =
          Rigid3{Eigen::Quaterniond(UprightCamFromStoredCam(6).transpose()), {0, 0, 0}} *
          pose.cam_from_world;
      transaction->PutPose(pose);
    }
    ASSERT_OK(transaction->Commit());
    ASSERT_OK(Look(scene));
    ASSERT_TRUE(RecordOf(*scene).georeference.place);
  }
  const EarthPlace expected = *RecordOf(upright).georeference.place,
                   found = *RecordOf(lying).georeference.place;
  EXPECT_LT(found.enu_from_world.rotation.angularDistance(expected.enu_from_world.rotation), 1e-6);
}

TEST(Georeferencing, TooLittleIsNoPlaceAndNoEntry) {
  SceneDatabase scene;
  Prepare(&scene, 6, 2);
  const uint64_t entries = scene.State().next_journal;
  ASSERT_OK(Look(&scene));
  EXPECT_FALSE(RecordOf(scene).georeference.place);
  EXPECT_EQ(RecordOf(scene).georeference.version, 0u);
  EXPECT_FALSE(IsLookDue(RecordOf(scene), true)) << "it was looked at";
  EXPECT_EQ(scene.State().next_journal, entries);
}

TEST(Georeferencing, APlaceThatNothingTellsAnyMoreIsGone) {
  SceneDatabase scene;
  Prepare(&scene, 6, 6);
  ASSERT_OK(Look(&scene));
  const auto transaction = scene.database()->BeginTransaction();
  for (uint32_t id = 1; id <= 6; ++id) {
    ImageRecord image = *scene.Snap()->GetImage(ImageId(id));
    image.gps.reset();
    transaction->PutImage(image);
  }
  ASSERT_OK(transaction->Commit());
  EXPECT_FALSE(*IsPlaceTold(*scene.Snap(), scene.State()));
  EXPECT_TRUE(IsLookDue(RecordOf(scene), false));
  ASSERT_OK(Look(&scene));
  EXPECT_FALSE(RecordOf(scene).georeference.place);
  EXPECT_EQ(RecordOf(scene).georeference.version, 1u) << "the next place is the second";
  EXPECT_FALSE(IsLookDue(RecordOf(scene), false));
  EXPECT_TRUE(FindViolations(*scene.Snap(), 9)->empty());
}

TEST(Georeferencing, ACommitInBetweenIsAConflict) {
  SceneDatabase scene;
  Prepare(&scene, 6, 6);
  WriteScope scope = BeginWrite(scene.database());
  const auto other = scene.database()->BeginTransaction();
  other->PutState(scene.State());
  ASSERT_OK(other->Commit());
  EXPECT_EQ(LookForPlace(ReconstructionId(1), std::move(scope)).code(), StatusCode::kBusy);
  EXPECT_FALSE(RecordOf(scene).georeference.place);
}

TEST(Georeferencing, GroundPointsAreReplacedAndLookedAt) {
  SceneDatabase scene;
  Prepare(&scene, 6, 6);
  const std::vector<GroundPoint> points = {{"a", kOrigin, 0.05, {}}, {"b", kOrigin, 0.05, {}}};
  ASSERT_OK(SetGroundPoints(points, "anna", BeginWrite(scene.database())));
  EXPECT_EQ(*scene.Snap()->ListGroundPoints(), points);
  EXPECT_EQ(RecordOf(scene).georeference.version, 1u);
  ASSERT_OK(SetGroundPoints(std::span(points).first(1), "anna", BeginWrite(scene.database())));
  EXPECT_EQ(scene.Snap()->ListGroundPoints()->size(), 1u);
  ASSERT_OK(SetGroundPoints({}, "anna", BeginWrite(scene.database())));
  EXPECT_TRUE(scene.Snap()->ListGroundPoints()->empty());
  EXPECT_TRUE(RecordOf(scene).georeference.place) << "the photos tell it, too";
  EXPECT_TRUE(FindViolations(*scene.Snap(), 9)->empty());
}

}  // namespace
}  // namespace veduta
