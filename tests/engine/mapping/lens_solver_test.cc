// SPDX-License-Identifier: Apache-2.0
// Goal: focal lengths are found together with poses and points; what is not to be refined stays,
//   and a problem that cannot be solved is left as it is.
// Method: a synthetic scene whose focal lengths are taken 3 % too short.
#include "engine/mapping/lens_solver.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

BundleProblem ShortFocalLengths(const SyntheticScene& scene) {
  const CityMap map = MakeMap(scene);
  BundleProblem problem;
  std::vector<ImageId> images;
  for (const auto& [id, image] : map.images()) {
    images.push_back(id);
    problem.cams_from_world.push_back(image.cam_from_world);
    problem.cameras.push_back(image.camera);
    problem.cameras.back().fx *= 0.97, problem.cameras.back().fy *= 0.97;
  }
  problem.free_count = static_cast<uint32_t>(images.size()) - 1;
  for (const PointId id : map.PointsSeenBy(images)) {
    problem.points.push_back(map.point(id).position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (const TrackElement& element : map.point(id).track) {
      const Sighting seen = map.image(element.image).ViewOf(element.feature);
      problem.observations.push_back({element.image.value - 1, seen.x_px});
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

TEST(LensSolver, FindsTheFocalLengthAndHoldsTheLastPose) {
  const SyntheticScene scene = MakeScene({});
  const BundleProblem before = ShortFocalLengths(scene);
  const std::vector<std::optional<uint32_t>> lens_of(before.cameras.size(), 0);
  double first = 0;
  for (int run = 0; run < 2; ++run) {
    BundleProblem problem = before;
    double factor = 1;
    ASSERT_TRUE(SolveWithLenses({}, lens_of, &problem, {&factor, 1}));
    EXPECT_NEAR(factor, 1 / 0.97, 0.004);
    EXPECT_LT(
        (problem.cams_from_world.back().Center() - before.cams_from_world.back().Center()).norm(),
        1e-9);
    EXPECT_GT((problem.points[0] - before.points[0]).norm(), 1e-6);
    if (run == 0) first = factor;
    EXPECT_EQ(factor, first) << "the same each time";
  }
}

TEST(LensSolver, WhereNoLensIsFreePosesAndPointsAreRefined) {
  BundleProblem problem = ShortFocalLengths(MakeScene({}));
  const BundleProblem before = problem;
  const std::vector<std::optional<uint32_t>> lens_of(problem.cameras.size());
  ASSERT_TRUE(SolveWithLenses({}, lens_of, &problem, {}));
  EXPECT_NE(problem.points[0], before.points[0]);
}

TEST(LensSolver, LeavesWhatItCannotSolve) {
  BundleProblem problem = ShortFocalLengths(MakeScene({}));
  problem.points[0].x() = std::nan("");
  const BundleProblem before = problem;
  const std::vector<std::optional<uint32_t>> lens_of(problem.cameras.size(), 0);
  double factor = 1;
  EXPECT_FALSE(SolveWithLenses({}, lens_of, &problem, {&factor, 1}));
  EXPECT_EQ(factor, 1);
  EXPECT_EQ(problem.points[1], before.points[1]);
}

}  // namespace
}  // namespace veduta
