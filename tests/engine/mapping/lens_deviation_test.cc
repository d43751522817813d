// SPDX-License-Identifier: Apache-2.0
// Goal: the deviation that is told of a focal length is how much the focal length varies; a lens
//   that nothing tells has none.
// Method: the focal length of one synthetic scene is refined from wrong ones with the noise of many
//   seeds, and its errors are compared with what is told.
#include "engine/mapping/lens_deviation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/mapping/lens_solver.h"
#include "scene_problem.h"

namespace veduta {
namespace {

TEST(LensDeviation, IsHowMuchTheFocalLengthIsOff) {
  constexpr int kSeeds = 60;
  for (const uint32_t lens_count : {1u, 2u}) {
    std::vector<double> squares(lens_count), told(lens_count), start(lens_count);
    for (int seed = 1; seed <= kSeeds; ++seed) {
      SceneOptions options;
      options.seed = 7;
      options.point_count = 150;
      options.noise_px = 0;
      SyntheticScene scene = MakeScene(options);
      BundleProblem problem = ProblemOf(scene);
      const Pinhole& c = scene.camera;
      const CameraModel truth{SyntheticScene::kWidth,
                              SyntheticScene::kHeight,
                              c.fx,
                              c.fy,
                              c.cx,
                              c.cy,
                              0,
                              0,
                              c.cx,
                              c.cy};
      SeededRandom random(seed);
      for (BundleObservation& seen : problem.observations)
        seen.x_px += 0.5 * Eigen::Vector2d(Gaussian(random), Gaussian(random));
      // Known to as much as what the solver draws them to.
      BundleLenses lenses;
      for (double& off : start) {
        const LensChange change(kLensPriorSigmas[0] * Gaussian(random),
                                kLensPriorSigmas[1] * Gaussian(random),
                                kLensPriorSigmas[2] * Gaussian(random));
        off = change[0];
        lenses.models.push_back(ChangedLens(truth, change));
      }
      for (uint32_t i = 0; i < problem.cameras.size(); ++i)
        lenses.of_image.push_back(i % lens_count);
      const auto changes = SolveWithLenses({}, lenses, &problem);
      ASSERT_TRUE(changes.has_value());
      for (uint32_t i = 0; i < lens_count; ++i)
        lenses.models[i] = ChangedLens(lenses.models[i], (*changes)[i]);
      const std::vector<double> deviations = LensDeviations({}, lenses, problem);
      EXPECT_EQ(deviations, LensDeviations({}, lenses, problem)) << "the same again";
      for (uint32_t lens = 0; lens < lens_count; ++lens) {
        squares[lens] += std::pow(start[lens] + (*changes)[lens][0], 2) / kSeeds;
        told[lens] += deviations[lens] / kSeeds;
      }
    }
    for (uint32_t lens = 0; lens < lens_count; ++lens) {
      const double spread = std::sqrt(squares[lens]);
      std::printf("focal lengths are %.4f %% off, and %.4f %% is told\n", 100 * spread,
                  100 * told[lens]);
      EXPECT_GT(told[lens], 0.75 * spread) << lens_count;
      EXPECT_LT(told[lens], 1.35 * spread) << lens_count;
    }
  }
}

TEST(LensDeviation, IsNoneWhereNothingTellsIt) {
  const SyntheticScene scene = MakeScene({});
  BundleProblem problem = ProblemOf(scene);
  const Pinhole& c = scene.camera;
  const CameraModel lens{
      SyntheticScene::kWidth, SyntheticScene::kHeight, c.fx, c.fy, c.cx, c.cy, 0, 0, c.cx, c.cy};
  BundleLenses lenses{{lens, lens}, std::vector<std::optional<uint32_t>>(problem.cameras.size())};
  lenses.of_image[0] = 0;
  const std::vector<double> deviations = LensDeviations({}, lenses, problem);
  EXPECT_GT(deviations[0], 0);
  EXPECT_EQ(deviations[1], 0);
  problem.free_count = 0;
  EXPECT_EQ(LensDeviations({}, lenses, problem), (std::vector<double>{0, 0}));
  lenses.models.clear();
  EXPECT_TRUE(LensDeviations({}, lenses, problem).empty());
}

}  // namespace
}  // namespace veduta
