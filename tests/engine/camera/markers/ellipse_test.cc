// SPDX-License-Identifier: Apache-2.0
// Goal: ellipses are fitted exactly to exact points and well to part of a noisy outline, and a
//   circle's homography maps centre and outline as the true one does.
// Method: ellipses of seeded sizes; an arc with noise; circles seen through random cameras.
#include "engine/camera/markers/ellipse.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

std::vector<Eigen::Vector2d> Outline(const Ellipse& ellipse, double from_deg, double to_deg,
                                     int count) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double angle = (from_deg + (to_deg - from_deg) * i / count) * std::numbers::pi / 180;
    points.push_back(ellipse.At(Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  }
  return points;
}

TEST(FitEllipse, IsExactOnExactPoints) {
  SeededRandom random(3);
  for (int i = 0; i < 50; ++i) {
    Ellipse truth;
    truth.center = {4000 * random.Unit(), 3000 * random.Unit()};
    truth.major = 3 + 300 * random.Unit();
    truth.minor = truth.major * (0.2 + 0.75 * random.Unit());
    truth.angle_rad = std::numbers::pi * (random.Unit() - 0.5);
    const auto fit = FitEllipse(Outline(truth, 0, 360, 40));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - truth.center).norm(), 1e-5 * truth.major);
    EXPECT_NEAR(fit->major, truth.major, 1e-5 * truth.major);
    EXPECT_NEAR(fit->minor, truth.minor, 1e-5 * truth.major);
    const double turn = fit->angle_rad - truth.angle_rad;
    EXPECT_NEAR(std::sin(turn), 0, 1e-4);
  }
}

TEST(FitEllipse, ToleratesNoiseOnAnArc) {
  SeededRandom random(4);
  const Ellipse truth = {{100, 80}, 40, 25, 0.5};
  std::vector<Eigen::Vector2d> points = Outline(truth, 20, 240, 60);
  for (Eigen::Vector2d& p : points)
    p += Eigen::Vector2d{random.Unit() - 0.5, random.Unit() - 0.5} * 0.6;
  const auto fit = FitEllipse(points);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->center - truth.center).norm(), 1.0);
  EXPECT_NEAR(fit->major, truth.major, 1.0);
  EXPECT_NEAR(fit->minor, truth.minor, 1.0);
}

TEST(FitEllipse, RefusesWhatIsNone) {
  const std::vector<Eigen::Vector2d> four = {{0, 0}, {1, 0}, {0, 1}, {2, 2}};
  EXPECT_FALSE(FitEllipse(four));
  std::vector<Eigen::Vector2d> line, same(10, {3, 4}), hyperbola;
  for (int i = 0; i < 20; ++i) line.emplace_back(i, 2 * i);
  for (int i = 1; i < 20; ++i) hyperbola.emplace_back(i, 40.0 / i);
  EXPECT_FALSE(FitEllipse(line));
  EXPECT_FALSE(FitEllipse(same));
  const auto fit = FitEllipse(hyperbola);
  EXPECT_TRUE(!fit || fit->major > 30) << "no small ellipse comes out of a hyperbola";
}

TEST(OutlineDistance, IsTheDistanceNearTheOutline) {
  const Ellipse ellipse = {{10, 20}, 30, 12, 0.3};
  for (const double d : {-0.2, 0.1}) {
    for (int i = 0; i < 12; ++i) {
      const double angle = i * 0.5;
      const Eigen::Vector2d unit(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d normal =
          (ellipse.AxisMatrix().inverse().transpose() * unit).normalized();
      EXPECT_NEAR(OutlineDistance(ellipse, ellipse.At(unit) + d * normal), d, 0.01);
    }
  }
}

TEST(HomographyFromCircle, IsTheTrueOneUpToATurn) {
  SeededRandom random(5);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix3d truth = Eigen::Matrix3d::Identity();
    truth.topLeftCorner<2, 2>() << 60 + 20 * random.Unit(), 10 * random.Unit(), -15 * random.Unit(),
        30;
    truth.topRightCorner<2, 1>() << 400, 300;
    truth.bottomLeftCorner<1, 2>() << 0.4 * random.Unit() - 0.2, 0.4 * random.Unit() - 0.2;
    std::vector<Eigen::Vector2d> outline;
    for (int i = 0; i < 60; ++i) {
      const double angle = 2 * std::numbers::pi * i / 60;
      outline.push_back(
          (truth * Eigen::Vector3d(std::cos(angle), std::sin(angle), 1)).hnormalized());
    }
    const Eigen::Vector2d center = truth.col(2).hnormalized();
    const auto ellipse = FitEllipse(outline);
    ASSERT_TRUE(ellipse);
    EXPECT_GT((ellipse->center - center).norm(), 0.05) << "the bias that the checkerboard is for";
    const Eigen::Matrix3d found = HomographyFromCircle(*ellipse, center);
    EXPECT_LT((found.col(2).hnormalized() - center).norm(), 1e-6);
    // From the true frame to the found one there is only a turn, or a turn of the mirror image.
    Eigen::Matrix3d turn = found.inverse() * truth;
    turn /= turn(2, 2);
    EXPECT_LT(turn.col(2).head(2).norm() + turn.row(2).head(2).norm(), 1e-5);
    const Eigen::Matrix2d plane = turn.topLeftCorner(2, 2);
    EXPECT_TRUE((plane * plane.transpose()).isIdentity(1e-5));
  }
}

}  // namespace
}  // namespace veduta
