// SPDX-License-Identifier: Apache-2.0
// Goal: a lens that photos of the city have told wrongly is refined with the structure, and stored
//   with it in one transaction; one that somebody has given stays; images of the camera in
//   another reconstruction keep what theirs rests on; it is due now and then, and not always.
// Method: synthetic scenes in a database, whose camera is 3 % off.
#include "engine/ingest/lens_refinement.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"
#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/mapping/pair_matches.h"
#include "engine/matching/two_view.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

SceneOptions ManyCameras() {
  SceneOptions options;
  options.camera_count = 14;
  return options;
}

std::vector<uint32_t> Range(uint32_t begin, uint32_t end) {
  std::vector<uint32_t> range;
  for (uint32_t i = begin; i < end; ++i) range.push_back(i);
  return range;
}

void PutCamera(SceneDatabase* scene, double factor, bool is_refinable) {
  CameraRecord camera = *scene->Snap()->GetCamera(SceneDatabase::ImageCamera());
  camera.model.fx *= factor, camera.model.fy *= factor;
  camera.is_refinable = is_refinable;
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutCamera(camera);
  ASSERT_OK(transaction->Commit());
}

// From now on the lens is believed to be another one than the photos were straightened by, which is
// the true one.
void BelieveInDistortion(SceneDatabase* scene) {
  CameraRecord camera = *scene->Snap()->GetCamera(SceneDatabase::ImageCamera());
  camera.is_refinable = true;
  camera.refined_from = camera.model;
  camera.model.fx *= 0.98, camera.model.fy *= 0.98;
  camera.model.k1 = 0.03, camera.model.k2 = -0.02;
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutCamera(camera);
  ASSERT_OK(transaction->Commit());
}

// The pairs of an image are those that the lens as it is believed to be now finds.
void VerifyAgain(SceneDatabase* scene, ImageId image) {
  const auto snapshot = scene->Snap();
  const auto own = *scene->features()->Get(*snapshot, image);
  const auto transaction = scene->database()->BeginTransaction();
  const auto x = [](const ImageFeatures& of, FeatureIndex feature) {
    return of.camera.Normalize(of.features->keypoints[feature]);
  };
  const auto neighbors = snapshot->ListNeighbors(image);
  ASSERT_OK(neighbors);
  ASSERT_FALSE(neighbors->empty());
  for (const PairNeighbor& neighbor : *neighbors) {
    PairMatches pair = MatchesFrom(*snapshot->GetPair(image, neighbor.image), image);
    const auto other = *scene->features()->Get(*snapshot, neighbor.image);
    std::vector<Eigen::Vector2d> x_own, x_other;
    for (const FeatureMatch& match : pair.matches) {
      x_own.push_back(x(*own, match.a));
      x_other.push_back(x(*other, match.b));
    }
    const TwoViewGeometry found =
        EstimateTwoView(x_own, x_other, own->camera.focal_px(), 1, TwoViewOptions());
    std::vector<FeatureMatch> inliers;
    for (const uint32_t i : found.inliers) inliers.push_back(pair.matches[i]);
    pair.matches = inliers;
    pair.geometry = found.geometry;
    pair.other_from_photo = found.b_from_a;
    pair.lens_photo = {own->camera.focal_px(), own->lens.k1, own->lens.k2};
    pair.lens_other = {other->camera.focal_px(), other->lens.k1, other->lens.k2};
    transaction->PutPair(RecordOf(pair, image));
  }
  ASSERT_OK(transaction->Commit());
}

void RefineAndWrite(SceneDatabase* scene, ReconstructionId id) {
  const IngestOptions options;
  Retrieval retrieval{{}};
  CityMap map;
  const IngestParts parts{scene->database(), &retrieval, scene->features(),
                          scene->pool(),     options,    &map};
  WriteScope scope = BeginWrite(scene->database());
  MapLoader loader(scope.base, scene->features(), &map);
  const auto healing =
      AdjustReconstruction({&loader, &map, scene->pool(), options.mapper}, id, Lenses::kRefined);
  ASSERT_OK(healing);
  ASSERT_OK(WriteAdjustedWhole(parts, id, *healing, std::move(scope)));
}

TEST(LensRefinement, FindsTheFocalLengthAndStoresItWithTheStructure) {
  SceneDatabase scene(ManyCameras());
  scene.AddImages(0, 14);
  const ReconstructionId id = scene.AddReconstruction(Range(0, 14));
  PutCamera(&scene, 0.97, true);
  // In the cache of features from before.
  ASSERT_OK(scene.features()->Get(*scene.Snap(), ImageId(3)));
  RefineAndWrite(&scene, id);
  const CameraRecord camera = *scene.Snap()->GetCamera(SceneDatabase::ImageCamera());
  const double truth = scene.scene().camera.fx;
  EXPECT_NEAR(camera.model.fx, truth, 0.003 * truth);
  EXPECT_TRUE(camera.is_refinable);
  EXPECT_EQ(camera.version, 2u);
  EXPECT_GT(camera.focal_stddev_share, 0);
  EXPECT_LT(camera.focal_stddev_share, 0.003);
  EXPECT_EQ((*scene.features()->Get(*scene.Snap(), ImageId(3)))->camera.fx, camera.model.fx);
  EXPECT_EQ(scene.Snap()->ListCameras()->size(), 1u);
  ExpectSound(scene);
}

TEST(LensRefinement, FindsTheDistortionAndFeaturesFollowIt) {
  SceneDatabase scene(ManyCameras());
  scene.AddImages(0, 14);
  const ReconstructionId id = scene.AddReconstruction(Range(0, 14));
  BelieveInDistortion(&scene);
  const Features stored = *scene.Snap()->GetFeatures(scene.Snap()->GetImage(ImageId(3))->photo);
  const auto before = *scene.features()->Get(*scene.Snap(), ImageId(3));
  EXPECT_NE(before->features->keypoints, stored.keypoints);
  VerifyAgain(&scene, ImageId(3));
  RefineAndWrite(&scene, id);
  const CameraRecord camera = *scene.Snap()->GetCamera(SceneDatabase::ImageCamera());
  EXPECT_EQ(camera.extraction_model(), scene.Model());
  EXPECT_NEAR(camera.model.fx, scene.Model().fx, 0.003 * scene.Model().fx);
  // The truth has no distortion.
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(100, 100), Eigen::Vector2d(300, 200)})
    EXPECT_LT((DistortPixel(camera.model, place) - place).norm(), 1.5);
  const auto after = *scene.features()->Get(*scene.Snap(), ImageId(3));
  EXPECT_NE(after->features->keypoints, before->features->keypoints);
  EXPECT_EQ(scene.Snap()->GetFeatures(scene.Snap()->GetImage(ImageId(3))->photo)->keypoints,
            stored.keypoints);
  ExpectSound(scene);
}

TEST(LensRefinement, AGivenFocalLengthStays) {
  SceneDatabase scene(ManyCameras());
  scene.AddImages(0, 14);
  const ReconstructionId id = scene.AddReconstruction(Range(0, 14));
  RefineAndWrite(&scene, id);
  EXPECT_EQ(scene.Snap()->GetCamera(SceneDatabase::ImageCamera())->model, scene.Model());
  ExpectSound(scene);
}

// Two reconstructions whose images have one camera, which is 3 % off in the first.
struct TwoSides {
  explicit TwoSides(uint32_t own_count) {
    scene.AddImages(0, 14);
    PutCamera(&scene, 1, true);
    own = scene.AddReconstruction(Range(0, own_count));
    scene.AddReconstruction(Range(own_count, 14));
  }

  CameraId CameraOf(uint32_t image) const { return scene.Snap()->GetImage(ImageId(image))->camera; }

  SceneDatabase scene{ManyCameras()};
  ReconstructionId own;
};

TEST(LensRefinement, WhatHardlyChangesIsLeftWhereOthersRestOnIt) {
  TwoSides sides(9);
  RefineAndWrite(&sides.scene, sides.own);
  EXPECT_EQ(sides.scene.Snap()->GetCamera(SceneDatabase::ImageCamera())->model,
            sides.scene.Model());
  EXPECT_EQ(sides.scene.Snap()->ListCameras()->size(), 1u);
  ExpectSound(sides.scene);
}

TEST(LensRefinement, WhereNothingIsRefinedTheMapIsAsItWas) {
  TwoSides sides(9);
  const IngestOptions options;
  CityMap map;
  MapLoader loader(sides.scene.Snap(), sides.scene.features(), &map, sides.scene.pool());
  std::vector<ImageId> images;
  ASSERT_OK(loader.LoadReconstruction(sides.own, &images));
  const std::map<ImageId, MapImage> before = map.images();
  std::map<PointId, Eigen::Vector3d> points;
  for (const PointId id : map.PointsSeenBy(images)) points[id] = map.point(id).position;
  const auto refined =
      RefineLenses({&loader, &map, sides.scene.pool(), options.mapper}, sides.own, images);
  ASSERT_OK(refined);
  EXPECT_TRUE(refined->empty());
  ASSERT_FALSE(images.empty());
  for (const ImageId id : images) {
    EXPECT_EQ(map.image(id).camera.fx, before.at(id).camera.fx);
    EXPECT_EQ(map.image(id).camera.fy, before.at(id).camera.fy);
    EXPECT_EQ(map.image(id).features->keypoints, before.at(id).features->keypoints);
    EXPECT_EQ(map.image(id).cam_from_world.translation, before.at(id).cam_from_world.translation);
  }
  for (const auto& [id, position] : points) EXPECT_EQ(map.point(id).position, position);
}

TEST(LensRefinement, TheSideWithMostOfTheImagesRefinesTheOthersKeepWhatTheyRestOn) {
  TwoSides sides(9);
  PutCamera(&sides.scene, 0.97, true);
  const double wrong = sides.scene.Snap()->GetCamera(SceneDatabase::ImageCamera())->model.fx;
  RefineAndWrite(&sides.scene, sides.own);
  const auto cameras = sides.scene.Snap()->ListCameras();
  ASSERT_EQ(cameras->size(), 2u);
  EXPECT_NEAR((*cameras)[0].model.fx, wrong / 0.97, 0.006 * wrong);
  EXPECT_EQ((*cameras)[1].model.fx, wrong);
  EXPECT_EQ((*cameras)[1].name, "scene (2)");
  EXPECT_EQ(sides.CameraOf(1), CameraId(1));
  EXPECT_EQ(sides.CameraOf(14), CameraId(2));
  // When all of them are in one reconstruction they have one camera again.
  const ReconstructionId all = sides.scene.AddReconstruction(Range(0, 14));
  RefineAndWrite(&sides.scene, all);
  EXPECT_EQ(sides.CameraOf(1), CameraId(1));
  EXPECT_EQ(sides.CameraOf(14), CameraId(1));
  EXPECT_EQ(sides.scene.Snap()->ListCameras()->size(), 2u);
}

TEST(LensRefinement, TheSideWithFewerOfTheImagesHolds) {
  TwoSides sides(5);
  PutCamera(&sides.scene, 0.97, true);
  const CameraModel wrong = sides.scene.Snap()->GetCamera(SceneDatabase::ImageCamera())->model;
  RefineAndWrite(&sides.scene, sides.own);
  EXPECT_EQ(sides.scene.Snap()->ListCameras()->size(), 1u);
  EXPECT_EQ(sides.scene.Snap()->GetCamera(SceneDatabase::ImageCamera())->model, wrong);
}

TEST(LensRefinement, IsDueAsTheReconstructionGrows) {
  const auto is_due = [](uint32_t images, uint32_t at_adjustment) {
    ReconstructionRecord record;
    record.image_count = images;
    record.images_at_adjustment = at_adjustment;
    return IsRefinementDue(record);
  };
  EXPECT_FALSE(is_due(11, 0));
  EXPECT_TRUE(is_due(12, 10));
  EXPECT_FALSE(is_due(14, 12));
  EXPECT_TRUE(is_due(18, 17));
  EXPECT_FALSE(is_due(26, 18));
  EXPECT_TRUE(is_due(100, 88));
  EXPECT_FALSE(is_due(100, 92));
  EXPECT_FALSE(is_due(100, 0)) << "merged";
  EXPECT_FALSE(is_due(601, 550));
}

}  // namespace
}  // namespace veduta
