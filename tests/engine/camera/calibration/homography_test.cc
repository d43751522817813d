// SPDX-License-Identifier: Apache-2.0
// Goal: homographies are exact on exact points, robust against wrong ones, and the gold
//   standard is better than the linear fit; what two calibrated views tell of a plane comes out
//   of the decomposition.
// Method: random homographies and motions of known truth.
#include "engine/camera/calibration/homography.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>

#include "engine/camera/calibration/homography_decomposition.h"
#include "storage/base/content_hash.h"
#include "storage/base/transform.h"

namespace veduta {
namespace {

double Between(SeededRandom& random, double low, double high) {
  return low + (high - low) * random.Unit();
}

double Gaussian(SeededRandom& random) {
  return std::sqrt(-2 * std::log(1 - random.Unit())) *
         std::cos(2 * std::numbers::pi * random.Unit());
}

struct Pairs {
  Eigen::Matrix3d b_from_a;
  std::vector<Eigen::Vector2d> a, b;
};

Pairs MakePairs(uint64_t seed, size_t count, double noise) {
  SeededRandom random(seed);
  Pairs pairs;
  pairs.b_from_a << Between(random, 0.7, 1.3), Between(random, -0.5, 0.5),
      Between(random, -0.2, 0.2), Between(random, -0.5, 0.5), Between(random, 0.7, 1.3),
      Between(random, -0.2, 0.2), Between(random, -0.4, 0.4), Between(random, -0.4, 0.4), 1;
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d a(Between(random, -0.5, 0.5), Between(random, -0.4, 0.4));
    const Eigen::Vector2d b = Transfer(pairs.b_from_a, a);
    pairs.a.push_back(a + noise * Eigen::Vector2d{Gaussian(random), Gaussian(random)});
    pairs.b.push_back(b + noise * Eigen::Vector2d{Gaussian(random), Gaussian(random)});
  }
  return pairs;
}

// RMS over a grid of where the homography takes points, against the truth.
double ErrorOf(const Eigen::Matrix3d& h, const Pairs& truth) {
  double sum = 0;
  for (int i = 0; i < 25; ++i) {
    const Eigen::Vector2d a((i % 5 - 2) * 0.2, (i / 5 - 2) * 0.16);
    sum += (Transfer(h, a) - Transfer(truth.b_from_a, a)).squaredNorm() / 25;
  }
  return std::sqrt(sum);
}

TEST(Homography, ExactPointsGiveTheExactOne) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const Pairs pairs = MakePairs(seed, 4 + seed % 5, 0);
    const auto h = FitHomography(pairs.a, pairs.b);
    ASSERT_TRUE(h);
    EXPECT_LT(ErrorOf(*h, pairs), 1e-7) << seed;
    EXPECT_NEAR(h->norm(), 1, 1e-12);
    for (const Eigen::Vector2d& a : pairs.a) EXPECT_GT(h->row(2).dot(a.homogeneous()), 0);
  }
}

TEST(Homography, DegeneratePointsGiveNone) {
  Pairs pairs = MakePairs(1, 8, 0);
  EXPECT_FALSE(FitHomography({pairs.a.data(), 3}, {pairs.b.data(), 3}));
  for (size_t i = 0; i < 8; ++i)
    pairs.a[i] = {0.1 * static_cast<double>(i), 0.05 * static_cast<double>(i)};
  for (size_t i = 0; i < 8; ++i) pairs.b[i] = Transfer(pairs.b_from_a, pairs.a[i]);
  EXPECT_FALSE(FitHomography(pairs.a, pairs.b));  // all on a line
  std::fill(pairs.a.begin(), pairs.a.end(), Eigen::Vector2d(1, 2));
  EXPECT_FALSE(FitHomography(pairs.a, pairs.b));
  EXPECT_FALSE(EstimateHomography({pairs.a.data(), 5}, {pairs.b.data(), 5}, 0.01, 1));
}

TEST(Homography, WrongPairsAreLeftOut) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Pairs pairs = MakePairs(seed, 40, 1e-4);
    SeededRandom random(seed);
    for (size_t i = 0; i < 16; ++i)
      pairs.b[i] = {Between(random, -0.5, 0.5), Between(random, -0.4, 0.4)};
    const auto robust = EstimateHomography(pairs.a, pairs.b, 0.003, seed);
    ASSERT_TRUE(robust) << seed;
    EXPECT_LT(ErrorOf(robust->b_from_a, pairs), 5e-4) << seed;
    EXPECT_GE(robust->inliers.size(), 24u);
    EXPECT_LE(robust->inliers.size(), 26u);
    const auto again = EstimateHomography(pairs.a, pairs.b, 0.003, seed);
    EXPECT_EQ(robust->b_from_a, again->b_from_a);
  }
}

TEST(Homography, GoldStandardIsBetterThanTheLinearFit) {
  double linear = 0, gold = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    // One half of the points is ten times noisier, which the linear fit does not know.
    Pairs pairs = MakePairs(seed, 30, 2e-4);
    SeededRandom random(seed);
    std::vector<double> sigma(30, 2e-4);
    for (size_t i = 15; i < 30; ++i) {
      pairs.b[i] += 2e-3 * Eigen::Vector2d{Gaussian(random), Gaussian(random)};
      sigma[i] = 2e-3;
    }
    const std::vector<double> sigma_a(30, 2e-4);
    const auto start = FitHomography(pairs.a, pairs.b);
    ASSERT_TRUE(start);
    linear += ErrorOf(*start, pairs);
    gold += ErrorOf(RefineHomography(*start, pairs.a, pairs.b, sigma_a, sigma), pairs);
  }
  EXPECT_LT(gold, 0.4 * linear);
}

TEST(HomographyDecomposition, OneOfTheTwoIsTheTruth) {
  SeededRandom random(7);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d axis =
        Eigen::Vector3d{Gaussian(random), Gaussian(random), Gaussian(random)}.normalized();
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(Between(random, 0.05, 0.8), axis).toRotationMatrix();
    const Eigen::Vector3d t(Between(random, -1, 1), Between(random, -1, 1),
                            Between(random, -0.3, 0.3));
    const Eigen::Vector3d n =
        Eigen::Vector3d(Between(random, -0.6, 0.6), Between(random, -0.6, 0.6), 1).normalized();
    const Eigen::Matrix3d h = Between(random, -3, 3) * (rotation + t * n.transpose());
    double best = 1;
    for (const PlaneMotion& m : DecomposeHomography(h)) {
      EXPECT_LT((m.b_from_a * m.b_from_a.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-6);
      EXPECT_GE(m.normal_in_a.z(), 0);
      // Each explains the homography.
      Eigen::Matrix3d again = m.b_from_a + m.translation_per_distance * m.normal_in_a.transpose();
      again *= h.norm() / again.norm() * (again.cwiseProduct(h).sum() < 0 ? -1 : 1);
      EXPECT_LT((again - h).norm(), 1e-5 * h.norm()) << i;
      best = std::min(best, (m.normal_in_a - n).norm() + (m.b_from_a - rotation).norm() +
                                (m.translation_per_distance - t).norm());
    }
    EXPECT_LT(best, 1e-4) << i;
  }
}

TEST(HomographyDecomposition, ARotationAloneIsFound) {
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const PlaneMotion& m : DecomposeHomography(2 * rotation)) {
    EXPECT_LT((m.b_from_a - rotation).norm(), 1e-6);
    EXPECT_LT(m.translation_per_distance.norm(), 1e-6);
    EXPECT_NEAR(m.normal_in_a.norm(), 1, 1e-9);
  }
}

}  // namespace
}  // namespace veduta
