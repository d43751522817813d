// SPDX-License-Identifier: Apache-2.0
// Goal: five matches give essential matrices that satisfy their constraints, all but a few of them
//   to a millionth, the true one among them, and what OpenGV's solver gives; degenerate samples
//   give no nonsense; roots of polynomials are found.
// Method: rays of random scenes and motions, with and without outliers; polynomials made of roots.
#include "engine/matching/five_point.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

using Rays = std::array<Eigen::Vector3d, 5>;

struct Sample {
  Rays a, b;
  Eigen::Matrix3d essential;  // of norm 1
};

Eigen::Vector3d RandomVector(SeededRandom* random) {
  return {2 * random->Unit() - 1, 2 * random->Unit() - 1, 2 * random->Unit() - 1};
}

Sample MakeSample(uint64_t seed, double noise) {
  SeededRandom random(seed);
  const double angle = random.Unit();
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(angle, RandomVector(&random).normalized()).toRotationMatrix();
  const Eigen::Vector3d t = RandomVector(&random);
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  Sample sample;
  sample.essential = (cross * rotation).normalized();
  for (size_t k = 0; k < 5; ++k) {
    const Eigen::Vector3d p = 2 * RandomVector(&random) + Eigen::Vector3d(0, 0, 5);
    sample.a[k] = p;
    sample.b[k] = (rotation * p + t).normalized() + noise * RandomVector(&random);
  }
  return sample;
}

double Distance(const Eigen::Matrix3d& e, const Eigen::Matrix3d& f) {
  return std::min((e - f).norm(), (e + f).norm());
}

double Nearest(const EssentialMatrices& found, const Eigen::Matrix3d& e) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& f : found.all()) nearest = std::min(nearest, Distance(e, f));
  return nearest;
}

TEST(FivePoint, TheTrueMatrixIsAmongTheSolutions) {
  for (uint64_t seed = 1; seed <= 500; ++seed) {
    const Sample sample = MakeSample(seed, 0);
    EXPECT_LT(Nearest(SolveFivePoint(sample.a, sample.b), sample.essential), 1e-5) << seed;
  }
}

TEST(FivePoint, SolutionsSatisfyAllConstraints) {
  size_t all = 0, exact = 0;
  for (uint64_t seed = 1; seed <= 500; ++seed) {
    const Sample sample = MakeSample(seed, 0.1);
    const EssentialMatrices solutions = SolveFivePoint(sample.a, sample.b);
    for (const Eigen::Matrix3d& e : solutions.all()) {
      EXPECT_NEAR(e.norm(), 1, 1e-12);
      for (size_t k = 0; k < 5; ++k) EXPECT_NEAR(sample.b[k].dot(e * sample.a[k]), 0, 1e-12);
      const Eigen::Matrix3d square = e * e.transpose();
      const double off = (2 * square * e - square.trace() * e).norm();
      EXPECT_LT(off, 0.01) << seed;
      ++all;
      exact += off < 1e-6 ? 1 : 0;
    }
  }
  EXPECT_GT(all, 500u);
  EXPECT_GT(static_cast<double>(exact), 0.99 * static_cast<double>(all));
}

TEST(FivePoint, GivesWhatOpenGvGives) {
  size_t theirs = 0, found = 0, ours = 0;
  for (uint64_t seed = 1; seed <= 1000; ++seed) {
    const Sample sample = MakeSample(seed, seed % 2 == 0 ? 0.1 : 0.5);
    opengv::bearingVectors_t a, b;
    for (size_t k = 0; k < 5; ++k) {
      a.push_back(sample.a[k].normalized());
      b.push_back(sample.b[k].normalized());
    }
    const EssentialMatrices solutions = SolveFivePoint(sample.a, sample.b);
    ours += solutions.count;
    const opengv::relative_pose::CentralRelativeAdapter adapter(b, a);
    for (const auto& solution : opengv::relative_pose::fivept_stewenius(adapter)) {
      if (!(solution.imag().cwiseAbs().maxCoeff() < 1e-8)) continue;
      ++theirs;
      found += Nearest(solutions, solution.real().normalized()) < 1e-4 ? 1 : 0;
    }
  }
  EXPECT_GT(theirs, 1000u);
  EXPECT_GT(static_cast<double>(found), 0.998 * static_cast<double>(theirs));
  EXPECT_LT(static_cast<double>(ours), 1.002 * static_cast<double>(theirs));
}

TEST(FivePoint, DegenerateSamplesGiveFiniteMatricesOrNone) {
  const Eigen::Vector3d ray(0.1, 0.2, 1), nothing = Eigen::Vector3d::Zero();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Sample sample = MakeSample(1, 0);
  Rays same, twice = sample.a, zero = sample.a, broken = sample.a;
  same.fill(ray);
  twice[1] = twice[0];
  zero[2] = nothing;
  broken[3] = {nan, nan, nan};
  for (const Rays& rays : {same, twice, zero, broken}) {
    for (const Rays& others : {rays, sample.b}) {
      const EssentialMatrices solutions = SolveFivePoint(rays, others);
      for (const Eigen::Matrix3d& e : solutions.all()) EXPECT_TRUE(e.allFinite());
    }
  }
}

// The coefficients of the product of (t - root).
std::vector<double> FromRoots(std::span<const double> roots) {
  std::vector<double> p = {1};
  for (const double root : roots) {
    p.insert(p.begin(), 0);
    for (size_t k = 0; k + 1 < p.size(); ++k) p[k] -= root * p[k + 1];
  }
  return p;
}

TEST(FindRootsInUnit, FindsThoseInside) {
  std::array<double, 10> roots;
  const std::vector<double> inside = {-0.9, -0.31, -0.3, 0, 0.5, 0.999}, outside = {-3, 1.5, 20};
  std::vector<double> all = inside;
  all.insert(all.end(), outside.begin(), outside.end());
  ASSERT_EQ(FindRootsInUnit(FromRoots(all), &roots), inside.size());
  for (size_t i = 0; i < inside.size(); ++i) EXPECT_NEAR(roots[i], inside[i], 1e-9);
  EXPECT_EQ(FindRootsInUnit(FromRoots(outside), &roots), 0u);
  EXPECT_EQ(FindRootsInUnit(std::vector<double>{1, 0, 1}, &roots), 0u);
  EXPECT_EQ(FindRootsInUnit(std::vector<double>{7}, &roots), 0u);
  EXPECT_EQ(FindRootsInUnit(std::vector<double>(11, 0.0), &roots), 0u);
}

}  // namespace
}  // namespace veduta
