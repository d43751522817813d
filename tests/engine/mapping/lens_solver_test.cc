// SPDX-License-Identifier: Apache-2.0
// Goal: focal lengths, k1 and k2 are found together with poses and points; what is not to be
//   refined stays, and a problem that cannot be solved is left as it is.
// Method: a synthetic scene whose photos a lens has distorted. Its focal length is taken 3 % too
//   short, and its distortion for another one.
#include "engine/mapping/lens_solver.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"
#include "scene_problem.h"

namespace veduta {
namespace {

CameraModel TrueLens(const SyntheticScene& scene) {
  const Pinhole& c = scene.camera;
  return {SyntheticScene::kWidth,
          SyntheticScene::kHeight,
          c.fx,
          c.fy,
          c.cx,
          c.cy,
          -0.1,
          0.02,
          c.cx,
          c.cy};
}

// All images have the lens, as `believed`.
BundleLenses Believe(const CameraModel& truth, const CameraModel& believed,
                     BundleProblem* problem) {
  for (BundleObservation& seen : problem->observations) seen.x_px = DistortPixel(truth, seen.x_px);
  return {{believed}, std::vector<std::optional<uint32_t>>(problem->cameras.size(), 0)};
}

TEST(LensSolver, FindsTheLensAndHoldsTheLastPose) {
  const SyntheticScene scene = MakeScene({});
  const CameraModel truth = TrueLens(scene);
  CameraModel believed = truth;
  believed.fx *= 0.97, believed.fy *= 0.97, believed.k1 = -0.05, believed.k2 = 0;
  BundleProblem before = ProblemOf(scene);
  const BundleLenses lenses = Believe(truth, believed, &before);
  LensChange first;
  for (int run = 0; run < 2; ++run) {
    BundleProblem problem = before;
    const auto changes = SolveWithLenses({}, lenses, &problem);
    ASSERT_TRUE(changes.has_value());
    const CameraModel found = ChangedLens(believed, changes->front());
    EXPECT_NEAR(found.fx, truth.fx, 0.004 * truth.fx);
    EXPECT_NEAR(found.fy, truth.fy, 0.004 * truth.fy);
    EXPECT_NEAR(found.k1, truth.k1, 0.02);
    for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), Eigen::Vector2d(250, 200)})
      EXPECT_LT((DistortPixel(found, place) - DistortPixel(truth, place)).norm(), 1.0);
    EXPECT_LT(
        (problem.cams_from_world.back().Center() - before.cams_from_world.back().Center()).norm(),
        1e-9);
    EXPECT_GT((problem.points[0] - before.points[0]).norm(), 1e-6);
    if (run == 0) first = changes->front();
    EXPECT_EQ(changes->front(), first) << "the same each time";
  }
}

TEST(LensSolver, WhereNoLensIsFreePosesAndPointsAreRefined) {
  BundleProblem problem = ProblemOf(MakeScene({}));
  for (Pinhole& camera : problem.cameras) camera.fx *= 0.97, camera.fy *= 0.97;
  const BundleProblem before = problem;
  const BundleLenses none{{}, std::vector<std::optional<uint32_t>>(problem.cameras.size())};
  ASSERT_TRUE(SolveWithLenses({}, none, &problem).has_value());
  EXPECT_NE(problem.points[0], before.points[0]);
}

TEST(LensSolver, LeavesWhatItCannotSolve) {
  const SyntheticScene scene = MakeScene({});
  BundleProblem problem = ProblemOf(scene);
  const BundleLenses lenses = Believe(TrueLens(scene), TrueLens(scene), &problem);
  problem.points[0].x() = std::nan("");
  const BundleProblem before = problem;
  EXPECT_FALSE(SolveWithLenses({}, lenses, &problem).has_value());
  EXPECT_EQ(problem.points[1], before.points[1]);
}

}  // namespace
}  // namespace veduta
