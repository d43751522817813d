// SPDX-License-Identifier: Apache-2.0
// Goal: adjustment finds the optimum, holds what it should hold, keeps the frame, and repeats
//   bit for bit.
// Method: a synthetic map disturbed from the truth; the solver against Ceres, whose derivatives
//   are checked against numeric ones.
#include "engine/mapping/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <array>

#include "ceres_bundle.h"
#include "engine/camera/projection.h"
#include "engine/mapping/bundle_solver.h"
#include "engine/mapping/lens_projection.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

std::vector<ImageId> AllImages(const CityMap& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return ids;
}

void Disturb(CityMap* map, double amount, uint64_t seed) {
  SeededRandom random(seed);
  const auto small = [&] { return amount * (2 * random.Unit() - 1); };
  for (const ImageId id : AllImages(*map)) {
    Rigid3 pose = map->image(id).cam_from_world;
    pose.rotation =
        (Eigen::Quaterniond(1, small() / 10, small() / 10, small() / 10) * pose.rotation)
            .normalized();
    pose.translation += Eigen::Vector3d(small(), small(), small());
    map->SetPose(id, pose);
  }
  for (const PointId id : map->PointsSeenBy(AllImages(*map))) {
    map->SetPosition(id, map->point(id).position + Eigen::Vector3d(small(), small(), small()));
  }
}

double MeanError(const CityMap& map) {
  double sum = 0;
  const auto points = map.PointsSeenBy(AllImages(map));
  for (const PointId id : points) sum += map.point(id).error_px;
  return sum / static_cast<double>(points.size());
}

TEST(ReprojectionCost, DerivativesAreTheNumericOnes) {
  const ReprojectionCost cost(MakeScene({}).camera, {480, 420});
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, -2, 0.5).normalized()));
  std::array<double, 7> pose = {q.x(), q.y(), q.z(), q.w(), 0.3, -0.2, 6};
  std::array<double, 3> point = {0.5, -0.4, 1.2};
  const double* parameters[] = {pose.data(), point.data()};
  double residuals[2], by_pose[14], by_point[6];
  double* jacobians[] = {by_pose, by_point};
  ASSERT_TRUE(cost.Evaluate(parameters, residuals, jacobians));
  const PoseManifold manifold;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    double high[2], low[2];
    for (const int sign : {1, -1}) {
      std::array<double, 6> delta{};
      delta[k] = sign * kStep;
      std::array<double, 7> moved;
      manifold.Plus(pose.data(), delta.data(), moved.data());
      const double* at[] = {moved.data(), point.data()};
      cost.Evaluate(at, sign > 0 ? high : low, nullptr);
    }
    for (int r = 0; r < 2; ++r)
      EXPECT_NEAR(by_pose[7 * r + k], (high[r] - low[r]) / (2 * kStep), 1e-3) << k;
  }
  for (int k = 0; k < 3; ++k) {
    double high[2], low[2];
    for (const int sign : {1, -1}) {
      std::array<double, 3> moved = point;
      moved[k] += sign * kStep;
      const double* at[] = {pose.data(), moved.data()};
      cost.Evaluate(at, sign > 0 ? high : low, nullptr);
    }
    for (int r = 0; r < 2; ++r)
      EXPECT_NEAR(by_point[3 * r + k], (high[r] - low[r]) / (2 * kStep), 1e-3) << k;
  }
}

// The scene's own observations, poses and points disturbed; the last `held_count` images are held.
// Some observations are far off, and of each third point there are two only.
BundleProblem DisturbedProblem(uint32_t held_count, uint64_t seed) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  Disturb(&map, 0.05, seed);
  SeededRandom random(seed);
  BundleProblem problem;
  for (const auto& [id, image] : map.images()) {
    problem.cams_from_world.push_back(image.cam_from_world);
    problem.cameras.push_back(image.camera);
  }
  problem.free_count = static_cast<uint32_t>(problem.cameras.size()) - held_count;
  for (const PointId id : map.PointsSeenBy(AllImages(map))) {
    problem.points.push_back(map.point(id).position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (const TrackElement& element : map.point(id).track) {
      const Eigen::Vector2d x_px = map.image(element.image).ViewOf(element.feature).x_px;
      const double off = random.Unit() < 0.05 ? 30 : 0;
      const size_t seen = problem.observations.size() - problem.first_observation.back();
      if (problem.points.size() % 3 == 0 && seen == 2) break;
      problem.observations.push_back({element.image.value - 1, x_px + Eigen::Vector2d(off, 0)});
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

TEST(BundleSolver, FindsTheMinimumThatCeresFinds) {
  for (const uint32_t held_count : {1u, 3u}) {
    for (const uint32_t dense_images_max : {40u, 0u}) {
      SCOPED_TRACE(testing::Message() << held_count << " held, dense up to " << dense_images_max);
      const BundleOptions options{
          .iterations_max = 100, .function_tolerance = 1e-12, .dense_images_max = dense_images_max};
      BundleProblem ours = DisturbedProblem(held_count, 5), theirs = ours;
      const BundleSolution by_us = SolveBundle(options, nullptr, &ours),
                           by_ceres = SolveByCeres(options, &theirs);
      ASSERT_TRUE(by_us.is_usable && by_ceres.is_usable);
      EXPECT_NEAR(by_us.initial_cost, by_ceres.initial_cost, 1e-9 * by_ceres.initial_cost);
      EXPECT_NEAR(by_us.final_cost, by_ceres.final_cost, 1e-6 * by_ceres.final_cost);
      EXPECT_LT(by_us.final_cost, 0.5 * by_us.initial_cost);
      for (size_t i = 0; i < ours.cams_from_world.size() && held_count > 1;
           ++i) {  // else the scale is free
        EXPECT_LT((ours.cams_from_world[i].Center() - theirs.cams_from_world[i].Center()).norm(),
                  1e-4)
            << i;
      }
    }
  }
}

TEST(BundleSolver, ThreadsDoNotMatter) {
  BundleProblem serial = DisturbedProblem(2, 6);
  SolveBundle({}, nullptr, &serial);
  for (const size_t thread_count : {1, 3}) {
    ThreadPool pool(thread_count);
    BundleProblem parallel = DisturbedProblem(2, 6);
    SolveBundle({}, &pool, &parallel);
    EXPECT_EQ(parallel.points, serial.points);
    for (size_t i = 0; i < serial.cams_from_world.size(); ++i) {
      EXPECT_EQ(parallel.cams_from_world[i].translation, serial.cams_from_world[i].translation);
    }
  }
}

TEST(BundleSolver, PointsAloneAreRefinedWhereNoImageIsFree) {
  const uint32_t image_count = static_cast<uint32_t>(DisturbedProblem(0, 7).cameras.size());
  for (const uint32_t dense_images_max : {40u, 0u}) {
    BundleProblem problem = DisturbedProblem(image_count, 7);
    const BundleProblem before = problem;
    const BundleSolution solution =
        SolveBundle({.dense_images_max = dense_images_max}, nullptr, &problem);
    ASSERT_TRUE(solution.is_usable);
    EXPECT_LT(solution.final_cost, solution.initial_cost);
    EXPECT_NE(problem.points[0], before.points[0]);
    EXPECT_EQ(problem.cams_from_world[0].translation, before.cams_from_world[0].translation);
  }
}

TEST(BundleSolver, WhatIsNotDeterminedStaysFinite) {
  // Two images at one place tell no depth, and a point that lies behind both has no derivative.
  BundleProblem problem;
  problem.cams_from_world.resize(3);
  problem.cams_from_world[2].translation.x() = 1;
  problem.cameras.assign(3, MakeScene({}).camera);
  problem.free_count = 1;
  problem.points = {{0.1, 0.2, 5}, {0, 0, -3}, {0.3, -0.1, 4}};
  problem.first_observation = {0, 2, 4, 6};
  problem.observations = {{0, {500, 400}}, {1, {505, 400}}, {0, {500, 400}},
                          {1, {500, 400}}, {0, {540, 380}}, {2, {700, 380}}};
  const BundleSolution solution = SolveBundle({}, nullptr, &problem);
  EXPECT_TRUE(solution.is_usable);
  EXPECT_LT(solution.final_cost, solution.initial_cost);
  EXPECT_EQ(problem.points[1], Eigen::Vector3d(0, 0, -3));
  for (const Eigen::Vector3d& point : problem.points) EXPECT_TRUE(point.allFinite());
  EXPECT_TRUE(problem.cams_from_world[0].translation.allFinite());
  problem.points[0].x() = std::nan("");
  EXPECT_FALSE(SolveBundle({}, nullptr, &problem).is_usable);
}

TEST(BundleAdjustment, FindsTheTruthAndKeepsTheFrame) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  Disturb(&map, 0.05, 3);
  EXPECT_GT(MeanError(map), 3.0);
  const auto summary =
      AdjustBundle(&map, AllImages(map), map.PointsSeenBy(AllImages(map)), {}, nullptr);
  ASSERT_TRUE(summary.ok());
  EXPECT_LT(MeanError(map), 0.45);  // noise of 0.3 px in each coordinate
  for (uint32_t k = 0; k < scene.poses.size(); ++k) {
    const Rigid3& pose = map.image(scene.images[k].id).cam_from_world;
    // As near as the disturbed frame was.
    EXPECT_LT((pose.Center() - scene.poses[k].Center()).norm(), 0.12);
    EXPECT_LT(RotationErrorDeg(pose, scene.poses[k]), 1.0);
  }
}

// The map's images see by a lens what they saw before in photos that `truth` has taken.
void SeeThrough(const CameraModel& truth, ImageId id, const CameraModel& lens, CityMap* map) {
  const auto features = std::make_shared<Features>(*map->image(id).features);
  for (Keypoint& k : features->keypoints) {
    const auto place = UndistortPixel(lens, DistortPixel(truth, {k.x_px, k.y_px}));
    k.x_px = static_cast<float>(place->x()), k.y_px = static_cast<float>(place->y());
  }
  map->SetLens(id, Pinhole(lens), features, std::make_shared<const FeatureGrid>(*features));
}

TEST(BundleAdjustment, RefinesLensesThatSeveralImagesHave) {
  const SyntheticScene scene = MakeScene({});
  const Pinhole& c = scene.camera;
  const CameraModel truth{
      SyntheticScene::kWidth, SyntheticScene::kHeight, c.fx, c.fy, c.cx, c.cy, -0.1, 0, c.cx, c.cy};
  const LensChange off[] = {{std::log(0.97), 0.02, 0}, {std::log(1.02), -0.01, 0}};
  CityMap map = MakeMap(scene);
  const CityMap straight = MakeMap(scene);
  Disturb(&map, 0.02, 3);
  std::map<ImageId, uint32_t> lens_of;
  BundleLens lenses[2];
  for (int i = 0; i < 2; ++i) lenses[i].model = ChangedLens(truth, off[i]);
  for (const ImageId id : AllImages(map)) {
    if (id == ImageId(1)) continue;  // its lens is known
    lens_of[id] = id.value % 2;
    SeeThrough(truth, id, lenses[id.value % 2].model, &map);
  }
  const LensSetter set_lens = [&](ImageId id, const CameraModel& lens) {
    const MapImage& image = straight.image(id);
    map.SetLens(id, image.camera, image.features, image.grid);
    SeeThrough(truth, id, lens, &map);
    return Status::Ok();
  };
  const auto refined = AdjustBundleWithLenses(
      &map, AllImages(map), map.PointsSeenBy(AllImages(map)), lens_of, {}, set_lens, lenses);
  ASSERT_TRUE(refined.ok());
  EXPECT_TRUE(*refined);
  for (const BundleLens& lens : lenses) {
    EXPECT_NEAR(lens.model.fx, truth.fx, 0.003 * truth.fx);
    EXPECT_NEAR(lens.model.k1, truth.k1, 0.01);
    EXPECT_GT(lens.focal_stddev_share, 1e-5);
    EXPECT_LT(lens.focal_stddev_share, 0.003);
  }
  EXPECT_EQ(map.image(ImageId(1)).camera.fx, scene.camera.fx);
  EXPECT_EQ(map.image(ImageId(2)).camera.fx, lenses[0].model.fx);
  EXPECT_LT(MeanError(map), 0.45);
}

TEST(BundleAdjustment, ALensThatCannotBeSetIsAnError) {
  CityMap map = MakeMap(MakeScene({}));
  const Pinhole& c = map.image(ImageId(1)).camera;
  BundleLens lens{
      {SyntheticScene::kWidth, SyntheticScene::kHeight, c.fx, c.fy, c.cx, c.cy, 0, 0, c.cx, c.cy}};
  const LensSetter fail = [](ImageId, const CameraModel&) { return Status::IoError("torn"); };
  EXPECT_EQ(AdjustBundleWithLenses(&map, AllImages(map), map.PointsSeenBy(AllImages(map)),
                                   {{ImageId(1), 0}}, {}, fail, {&lens, 1})
                .status()
                .message(),
            "torn");
}

TEST(BundleAdjustment, HoldsImagesThatAreNotFree) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const ImageId free[] = {ImageId(3)};
  Rigid3 wrong = scene.poses[2];
  wrong.translation.x() += 0.05;
  map.SetPose(ImageId(3), wrong);
  ASSERT_TRUE(AdjustBundle(&map, free, map.PointsSeenBy(free), {}, nullptr).ok());
  EXPECT_EQ(map.image(ImageId(1)).cam_from_world.translation, scene.poses[0].translation);
  EXPECT_LT((map.image(ImageId(3)).cam_from_world.Center() - scene.poses[2].Center()).norm(), 0.01);
}

TEST(BundleAdjustment, RepeatsBitForBit) {
  Rigid3 first;
  for (int run = 0; run < 2; ++run) {
    CityMap map = MakeMap(MakeScene({}));
    Disturb(&map, 0.03, 8);
    ASSERT_TRUE(
        AdjustBundle(&map, AllImages(map), map.PointsSeenBy(AllImages(map)), {}, nullptr).ok());
    const Rigid3 pose = map.image(ImageId(4)).cam_from_world;
    if (run == 0) first = pose;
    EXPECT_EQ(pose.translation, first.translation);
    EXPECT_EQ(pose.rotation.coeffs(), first.rotation.coeffs());
  }
}

}  // namespace
}  // namespace veduta
