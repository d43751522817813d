// SPDX-License-Identifier: Apache-2.0
// Goal: errors of a chain of frames add up as they do in truth, and what is seen where a chain
//   closes moves it to the truth, or is found to contradict it.
// Method: motions drawn from known distributions; a synthetic scene in two frames.
#include "engine/mapping/uncertain_similarity.h"

#include <gtest/gtest.h>

#include "engine/mapping/similarity_step.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

using Vector7 = SimilarityStep::Vector7;
using Matrix7 = SimilarityStep::Matrix7;

Sim3 Turned(double scale, double angle, const Eigen::Vector3d& translation) {
  return {scale,
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized())),
          translation};
}

UncertainSimilarity Known(const Sim3& b_from_a, double deviation) {
  return {b_from_a, {Matrix7::Identity() * deviation * deviation}};
}

Vector7 Drawn(SeededRandom& random, double deviation) {
  Vector7 by;
  for (int i = 0; i < 7; ++i) by[i] = deviation * Gaussian(random);
  return by;
}

TEST(UncertainSimilarity, ErrorsOfAChainAddUp) {
  const Sim3 b_from_a = Turned(0.7, 0.8, {1, -2, 3}), c_from_b = Turned(2.5, -0.4, {-4, 5, 1});
  const double of_a = 2e-4, of_b = 1e-4;
  const UncertainSimilarity chain = Chain(Known(c_from_b, of_b), Known(b_from_a, of_a));
  const Eigen::Vector3d x_a(3, 1, -2), x_c = c_from_b * (b_from_a * x_a);
  EXPECT_LT((chain.b_from_a * x_a - x_c).norm(), 1e-12);
  SeededRandom random(5);
  double squared = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const Sim3 first = SimilarityStep::Moved(b_from_a, Drawn(random, of_a)),
               second = SimilarityStep::Moved(c_from_b, Drawn(random, of_b));
    squared += (second * (first * x_a) - x_c).squaredNorm() / kDraws;
  }
  EXPECT_NEAR(chain.covariance.PositionDeviation(x_c) / std::sqrt(squared), 1, 0.05);
}

TEST(UncertainSimilarity, ABendIsTheLargerTheFarther) {
  const Eigen::Vector3d pivot(2, 0, 1), along(0, 0, 10);
  const UncertainSimilarity bend = Bend(pivot, 0.01, 0.02);
  EXPECT_EQ((bend.b_from_a * along - along).norm(), 0);
  // A rotation moves it along two axes, the scale along the third.
  const double wanted = 10 * std::sqrt(2 * 0.01 * 0.01 + 0.02 * 0.02);
  EXPECT_NEAR(bend.covariance.PositionDeviation(pivot + along), wanted, 1e-9);
  EXPECT_LT(bend.covariance.PositionDeviation(pivot + 0.01 * along), 0.011 * wanted);
}

TEST(UncertainSimilarity, WhatAChainIsOffIsSpreadByHowUnsureItsLinksAre) {
  const Sim3 steps[] = {Turned(1.2, 0.3, {5, 0, 1}), Turned(0.8, -0.5, {4, 1, 0}),
                        Turned(1.5, 0.2, {3, -1, 2})};
  const std::vector<UncertainSimilarity> links = {Known(steps[0], 1e-9), Known(steps[1], 1e-3),
                                                  Known(steps[2], 1e-9)};
  Vector7 by;
  by << 1e-3, -2e-3, 1e-3, 3e-3, 1e-3, -1e-3, 2e-3;
  const Sim3 moved = SimilarityStep::Moved(steps[1], by), last = steps[0] * moved * steps[2];
  const std::vector<Sim3> frames = SpreadOver(links, last);
  ASSERT_EQ(frames.size(), 3u);
  const Eigen::Vector3d x(1, 2, 3);
  EXPECT_LT((frames[0] * x - steps[0] * x).norm(), 1e-6) << "the first link is sure";
  EXPECT_LT((frames[1] * x - steps[0] * (moved * x)).norm(), 1e-4) << "the second takes it all";
  EXPECT_EQ((frames[2] * x - last * x).norm(), 0);
}

// A scene of which frame a knows the cameras from 3 on, and frame b the first three.
class Closing : public testing::Test {
 protected:
  Closing() : scene_(MakeScene({})), b_from_a_(Turned(2.5, 0.4, {1, -2, 3})) {
    for (size_t i = 0; i < scene_.points.size(); ++i) {
      const int in_b = scene_.feature_of[0][i], in_a = scene_.feature_of[4][i];
      if (in_b < 0 || in_a < 0) continue;
      const MapImage &b = scene_.images[0], &a = scene_.images[4];
      const Rigid3 cam_a_from_a = TransformCameraWorld(b_from_a_.Inverse(), scene_.poses[4]);
      matches_.push_back({scene_.poses[0], b.camera.Normalize(b.features->keypoints[in_b]),
                          cam_a_from_a, a.camera.Normalize(a.features->keypoints[in_a]), 900});
      points_.push_back({b.id, scene_.poses[0], matches_.back().x_b,
                         b_from_a_.Inverse() * scene_.points[i], 900});
    }
  }
  // The truth after an error of `by`, known to `deviation` in each degree of freedom.
  UncertainSimilarity Off(double by, double deviation) const {
    Vector7 motion;
    motion << 0.5 * by, -by, by, by, by, -by, 0.5 * by;
    return Known(SimilarityStep::Moved(b_from_a_, motion), deviation);
  }
  double ErrorOf(const Sim3& found) const {
    const Rigid3 wanted = TransformCameraWorld(b_from_a_, matches_[0].cam_a_from_a),
                 is = TransformCameraWorld(found, matches_[0].cam_a_from_a);
    return (wanted.Center() - is.Center()).norm();
  }

  const SyntheticScene scene_;
  const Sim3 b_from_a_;
  std::vector<CrossMatch> matches_;
  std::vector<CrossSighting> points_;
};

TEST_F(Closing, MatchesAloneMoveAChainToTheTruth) {
  ASSERT_GT(matches_.size(), 100u);
  const UncertainSimilarity known = Off(0.03, 0.03);
  ASSERT_GT(ErrorOf(known.b_from_a), 0.1);
  const auto closed = CloseChain(known, {{}, {}, matches_});
  ASSERT_TRUE(closed);
  // Where along the line between the two cameras they stand, and the scale, matches leave open.
  EXPECT_LT(ErrorOf(closed->b_from_a), 0.6 * ErrorOf(known.b_from_a));
  EXPECT_GT(closed->distance, 0.5);
  EXPECT_LT(closed->distance, 4);
}

TEST_F(Closing, WithPointsItIsExact) {
  const UncertainSimilarity known = Off(0.03, 0.03);
  const auto closed = CloseChain(known, {points_, {}, matches_});
  ASSERT_TRUE(closed);
  EXPECT_LT(ErrorOf(closed->b_from_a), 0.02);
  EXPECT_EQ(closed->b_from_a.scale, CloseChain(known, {points_, {}, matches_})->b_from_a.scale);
}

TEST_F(Closing, WhatContradictsTheChainIsFarFromIt) {
  const auto closed = CloseChain(Off(0.05, 0.002), {points_, {}, matches_});
  ASSERT_TRUE(closed);
  EXPECT_GT(closed->distance, 20);
}

TEST_F(Closing, WithoutAFiniteCovarianceThereIsNothingToClose) {
  UncertainSimilarity known = Off(0.01, 0.01);
  known.covariance.matrix(2, 2) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(CloseChain(known, {points_, {}, matches_}));
  known.covariance.matrix.setZero();
  EXPECT_FALSE(CloseChain(known, {points_, {}, matches_}));
}

}  // namespace
}  // namespace veduta
