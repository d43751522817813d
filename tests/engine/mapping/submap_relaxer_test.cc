// SPDX-License-Identifier: Apache-2.0
// Goal: the solver ends where all views fit, whatever submaps see a tie; the first submap and,
//   where it is asked for, all of them stay; the sums do not depend on the number of threads.
// Method: submaps on a ring (submap_ring.h), and a tie that three of them see.
#include "engine/mapping/submap_relaxer.h"

#include <gtest/gtest.h>

#include "engine/mapping/triangulation.h"
#include "tests/engine/mapping/submap_ring.h"

namespace veduta {
namespace {

RelaxationEstimate StartOf(const RelaxationProblem& problem) {
  RelaxationEstimate start{std::vector<Sim3>(problem.centers.size()), problem.centers, {}};
  for (size_t tie = 0; tie + 1 < problem.first_view.size(); ++tie) {
    std::vector<Sighting> seen;
    for (uint32_t v = problem.first_view[tie]; v < problem.first_view[tie + 1]; ++v)
      seen.push_back(
          {problem.views[v].cam_from_world, problem.views[v].camera, problem.views[v].x_px});
    start.places.push_back(Triangulate(seen).value_or(Eigen::Vector3d::Zero()));
  }
  return start;
}

TEST(SubmapRelaxer, EndsWhereAllViewsFit) {
  const Ring ring = MakeRing({.drift = 0.001});
  ThreadPool pool(0);
  SubmapRelaxer relaxer(ring.problem, StartOf(ring.problem), &pool);
  const double before = relaxer.CostAt(2);
  relaxer.Minimise(2, 20, true);
  EXPECT_LT(relaxer.CostAt(2), 1e-6 * before);
  for (const Eigen::Vector2d& error : relaxer.Errors()) EXPECT_LT(error.norm(), 0.01);
  EXPECT_EQ(relaxer.estimate().new_from_old[0].translation, Eigen::Vector3d::Zero());
  EXPECT_NE(relaxer.estimate().new_from_old[1].translation, Eigen::Vector3d::Zero());
  EXPECT_LT(WorstCenter(ring, relaxer.estimate().new_from_old), 1e-4);
}

TEST(SubmapRelaxer, MovesPlacesAloneWhereItIsAskedTo) {
  const Ring ring = MakeRing({.drift = 0.001});
  ThreadPool pool(0);
  RelaxationEstimate start = StartOf(ring.problem);
  for (Eigen::Vector3d& place : start.places) place *= 1.01;
  SubmapRelaxer relaxer(ring.problem, start, &pool);
  const double before = relaxer.CostAt(2);
  relaxer.Minimise(2, 20, false);
  EXPECT_LT(relaxer.CostAt(2), before);
  for (const Sim3& motion : relaxer.estimate().new_from_old)
    EXPECT_EQ(motion.translation, Eigen::Vector3d::Zero());
}

TEST(SubmapRelaxer, ATieMayBeSeenByThreeSubmaps) {
  Ring ring = MakeRing({.drift = 0.001});
  // Two ties become one that three submaps see: the fit is spoilt, but the equations must
  // still lower the cost, and do so the more the longer they run.
  RelaxationProblem& problem = ring.problem;
  const size_t ties = problem.first_view.size() - 1;
  problem.first_view.erase(problem.first_view.begin() + 80);
  ASSERT_EQ(problem.first_view.size(), ties);
  ThreadPool pool(0);
  SubmapRelaxer relaxer(problem, StartOf(problem), &pool);
  double last = relaxer.CostAt(2);
  for (int i = 0; i < 3; ++i) {
    relaxer.Minimise(2, 1, true);
    EXPECT_LT(relaxer.CostAt(2), last);
    last = relaxer.CostAt(2);
  }
}

TEST(SubmapRelaxer, RepeatsBitForBitAtAnyNumberOfThreads) {
  const Ring ring = MakeRing({.drift = 0.005, .noise_px = 0.5});
  ThreadPool none(0), three(3);
  SubmapRelaxer first(ring.problem, StartOf(ring.problem), &none);
  SubmapRelaxer second(ring.problem, StartOf(ring.problem), &three);
  first.Minimise(2, 20, true);
  second.Minimise(2, 20, true);
  EXPECT_EQ(first.CostAt(2), second.CostAt(2));
  EXPECT_EQ(first.estimate().places, second.estimate().places);
}

}  // namespace
}  // namespace veduta
