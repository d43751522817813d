// SPDX-License-Identifier: Apache-2.0
// Goal: of a reconstruction that the evidence speaks against, images at wrong poses are un-placed,
//   parts that many verified pairs contradict are cut off, and all the rest stays; what may be
//   hidden from a view speaks against no pose.
// Method: synthetic scenes in a database: an image whose pose is shifted, and two sides with a few
//   common points and many verified matches that the poses do not explain.
#include "engine/ingest/doubt.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"
#include "tests/engine/ingest/torn_scene.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

std::vector<ImageId> LoadWhole(SceneWork* work, ReconstructionId id) {
  std::vector<ImageId> images;
  EXPECT_OK(work->loader.LoadReconstruction(id, &images));
  return images;
}

Healing Heal(SceneWork* work, const std::vector<ImageId>& images) {
  auto healing = HealRegion(work->context, images, images);
  EXPECT_OK(healing);
  return healing.ok() ? *healing : Healing();
}

TEST(Doubt, NothingIsTakenFromWhatIsRight) {
  SceneDatabase scene({.point_count = 2000});
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  SceneWork work(&scene);
  EXPECT_TRUE(Heal(&work, LoadWhole(&work, id)).empty());
  EXPECT_EQ(work.map.images().size(), 6u);
  EXPECT_TRUE(work.map.changes().blocks.empty());
}

// Image 3 stands wrong by half a unit, and keeps a few of its points, as a repeated facade would
// give them.
void Shift(SceneWork* work, const SyntheticScene& scene) {
  const ImageId wrong(3), self[] = {wrong};
  const std::vector<PointId> points = work->map.PointsSeenBy(self);
  for (size_t i = 40; i < points.size(); ++i) work->map.RemoveObservation(points[i], wrong);
  Rigid3 shifted = scene.poses[2];
  shifted.translation.x() += 0.5;
  work->map.SetPose(wrong, shifted);
}

// Every pose explains every pair.
void BelievePairs(SceneWork* work) {
  work->options.agreement.line_error_px_max = 1e6;
  work->options.agreement.point_error_px_max = 1e6;
}

TEST(Doubt, AnImageAtAWrongPoseIsUnplacedAndTheRestStays) {
  SceneDatabase scene({.point_count = 2000});
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  // By what verified pairs say, and where these are not heard by what the picture lacks.
  for (const bool hears_pairs : {true, false}) {
    SceneWork work(&scene);
    if (!hears_pairs) BelievePairs(&work);
    const auto images = LoadWhole(&work, id);
    Shift(&work, scene.scene());
    const VisibleStructure visible =
        FindAround(work.map, work.map.image(ImageId(3)), images, work.options.doubt);
    EXPECT_TRUE(IsContradicted(visible, work.options.doubt)) << MissingText(visible);
    const Healing healing = Heal(&work, images);
    ASSERT_EQ(healing.unplaced.size(), 1u);
    EXPECT_EQ(healing.unplaced[0].image, ImageId(3));
    EXPECT_NE(healing.unplaced[0].why.find(hears_pairs ? "contradicts where it was"
                                                       : "lack what other photos see"),
              std::string::npos)
        << healing.unplaced[0].why;
    EXPECT_TRUE(healing.parts.empty());
    EXPECT_EQ(work.map.images().size(), 5u);
    EXPECT_EQ(work.map.changes().unplaced.size(), 1u);
  }
}

// Camera 2 has points in the left part of its picture, finds what others see up to a line right of
// its middle, and lacks all of it beyond, as where a house hides it that has no points.
CityMap MapWithHiddenPart(const SyntheticScene& scene, const std::vector<uint32_t>& others) {
  MapImage view = scene.images[2];
  const double hidden_from_px = 0.6 * view.width_px;
  auto features = std::make_shared<Features>(*view.features);
  for (FeatureIndex i = 0; i < features->size(); ++i) {
    if (features->keypoints[i].x_px > hidden_from_px)
      std::fill_n(features->descriptors.data() + i * kDescriptorSize, kDescriptorSize, 255);
  }
  view.features = features;
  CityMap map;
  map.PlaceImage(view);
  for (const uint32_t k : others) map.PlaceImage(scene.images[k]);
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    std::vector<TrackElement> track;
    const auto see = [&](uint32_t k) {
      track.push_back({scene.images[k].id, static_cast<FeatureIndex>(scene.feature_of[k][i])});
    };
    const int own = scene.feature_of[2][i];
    if (own >= 0 && features->keypoints[own].x_px < hidden_from_px - 60) see(2);
    for (const uint32_t k : others) {
      if (scene.feature_of[k][i] >= 0) see(k);
    }
    if (track.size() >= 2) map.AddPoint(track.front().image, scene.points[i], track);
  }
  return map;
}

TEST(Doubt, WhatMayBeHiddenSpeaksAgainstNoPose) {
  const SyntheticScene scene = MakeScene({.camera_count = 6, .point_count = 4000});
  const DoubtOptions options;
  for (const bool from_either_side : {false, true}) {
    const std::vector<uint32_t> others =
        from_either_side ? std::vector<uint32_t>{0, 1, 3} : std::vector<uint32_t>{0, 1};
    const CityMap map = MapWithHiddenPart(scene, others);
    std::vector<ImageId> around;
    for (const uint32_t k : others) around.push_back(scene.images[k].id);
    const MapImage& view = map.image(scene.images[2].id);
    const VisibleStructure all = FindAround(map, view, around, options),
                           judged = JudgeAround(map, view, around, options);
    EXPECT_TRUE(IsContradicted(all, options)) << MissingText(all);
    EXPECT_EQ(IsContradicted(judged, options), from_either_side) << MissingText(judged);
  }
}

TEST(Doubt, APartThatPairsContradictIsCutOff) {
  SceneDatabase scene(kTwoSides);
  const ReconstructionId id = AddTwoSides(&scene);
  SceneWork before(&scene);
  EXPECT_TRUE(Heal(&before, LoadWhole(&before, id)).empty()) << "nothing speaks against it yet";
  ContradictSeam(&scene);
  SceneWork work(&scene);
  const Healing healing = Heal(&work, LoadWhole(&work, id));
  EXPECT_TRUE(healing.unplaced.empty());
  ASSERT_EQ(healing.parts.size(), 1u);
  EXPECT_EQ(healing.parts[0], SideImages(1));
  for (const PointId point : work.map.PointsSeenBy(healing.parts[0])) {
    for (const TrackElement& element : work.map.point(point).track)
      EXPECT_GE(element.image, healing.parts[0].front());
  }
}

// Half of the pairs across two halves show something else.
void ContradictHalves(SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  for (const uint32_t a : {2, 3}) {
    for (uint32_t b = 4; b < 8; ++b) {
      PairRecord pair = scene->scene().Pair(a, b);
      for (size_t i = 0; i + 1 < pair.matches.size(); ++i)
        std::swap(pair.matches[i].b, pair.matches[i + 1].b);
      transaction->PutPair(pair);
    }
  }
  ASSERT_OK(transaction->Commit());
}

TEST(Doubt, APartThatThePicturesConfirmStays) {
  SceneDatabase scene({.camera_count = 8, .point_count = 2000});
  scene.AddImages(0, 8);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5, 6, 7});
  ContradictHalves(&scene);
  {
    SceneWork work(&scene);
    EXPECT_TRUE(Heal(&work, LoadWhole(&work, id)).empty());
  }
  SceneWork work(&scene);
  work.options.doubt.seam_confirmed_cells_min = 1'000'000;  // more than there are
  const Healing healing = Heal(&work, LoadWhole(&work, id));
  ASSERT_EQ(healing.parts.size(), 1u);
  EXPECT_EQ(healing.parts[0], SideImages(1));
  SceneWork strict(&scene);
  strict.options.doubt.seam_confirmed_contradiction_share_max = 0.7;
  EXPECT_EQ(Heal(&strict, LoadWhole(&strict, id)).parts.size(), 1u);
}

TEST(Doubt, LessThanThreeImagesAreNoReconstruction) {
  SceneDatabase scene({.point_count = 2000});
  scene.AddImages(0, 3);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});
  SceneWork work(&scene);
  BelievePairs(&work);
  const auto images = LoadWhole(&work, id);
  Shift(&work, scene.scene());
  const Healing healing = Heal(&work, images);
  ASSERT_EQ(healing.unplaced.size(), 3u);
  EXPECT_EQ(healing.unplaced.back().why, "less than three images are left there that agree");
  EXPECT_TRUE(healing.parts.empty());
  EXPECT_TRUE(work.map.images().empty());
}

TEST(Doubt, RefusesWhatIsOutOfBounds) {
  using O = DoubtOptions;
  ExpectBounds(&O::images_max, "images_max", {0u}, {1u});
  ExpectBounds(&O::beside_angle_deg_max, "beside_angle_deg_max", {0.0, 90.0}, {1.0, 89.0});
  ExpectBounds(&O::missing_cells_min, "missing_cells_min", {0u}, {1u});
  ExpectBounds(&O::missing_share_max, "missing_share_max", {0.0, 1.1}, {0.01, 1.0});
  ExpectBounds(&O::better_cells_min, "better_cells_min", {0u}, {1u});
  ExpectBounds(&O::better_missing_cells_min, "better_missing_cells_min", {0u}, {1u});
  ExpectBounds(&O::better_missing_share_max, "better_missing_share_max", {-0.1, 1.1}, {0.0, 1.0});
  ExpectBounds(&O::either_side_points_min, "either_side_points_min", {0u}, {1u});
  ExpectBounds(&O::either_side_share_min, "either_side_share_min", {0.0, 1.1}, {0.01, 1.0});
  ExpectBounds(&O::either_side_matches_min, "either_side_matches_min", {0u}, {1u});
  ExpectBounds(&O::seam_pairs_min, "seam_pairs_min", {0u}, {1u});
  ExpectBounds(&O::seam_jackknife_share_max, "seam_jackknife_share_max", {0.0}, {0.001, 1.0});
  ExpectBounds(&O::seam_missing_share_max, "seam_missing_share_max", {0.0, 1.1}, {0.01, 1.0});
}

}  // namespace
}  // namespace veduta
