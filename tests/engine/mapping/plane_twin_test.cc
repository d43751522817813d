// SPDX-License-Identifier: Apache-2.0
// Goal: the second relative pose of a plane explains its matches as well as the first, and no other
// scene's.
// Method: two cameras of a synthetic scene; epipolar errors and depths by the true points.
#include "engine/mapping/plane_twin.h"

#include <gtest/gtest.h>

#include "engine/mapping/triangulation.h"
#include "engine/matching/two_view.h"
#include "scene_checks.h"

namespace veduta {
namespace {

struct TwoViews {
  Rigid3 b_from_a;
  std::vector<Eigen::Vector3d> points;  // in the frame of a
  Eigen::Vector3d ray = Eigen::Vector3d::Zero();
};

TwoViews Make(bool planar) {
  SceneOptions options;
  options.planar = planar;
  options.forward = 0.5;
  const SyntheticScene scene = MakeScene(options);
  TwoViews views;
  views.b_from_a = scene.poses[4] * scene.poses[0].Inverse();
  for (const Eigen::Vector3d& point : scene.points) {
    views.points.push_back(scene.poses[0] * point);
    views.ray += views.points.back().normalized();
  }
  return views;
}

// The largest Sampson distance of what both cameras see of the points, or infinite where a point
// does not lie before both.
double WorstOf(const TwoViews& views, const Rigid3& b_from_a) {
  std::vector<Eigen::Vector2d> x_a, x_b;
  for (const Eigen::Vector3d& point : views.points) {
    x_a.push_back(point.hnormalized());
    x_b.push_back((views.b_from_a * point).hnormalized());
  }
  const Eigen::Matrix3d essential = EssentialFromPose(b_from_a);
  double worst = 0;
  for (size_t i = 0; i < x_a.size(); ++i)
    worst = std::max(worst, SampsonDistance(essential, x_a[i], x_b[i]));
  return FindTwoViewInliers(b_from_a, x_a, x_b, worst + 1e-6).size() == x_a.size()
             ? worst
             : std::numeric_limits<double>::infinity();
}

TEST(PlaneTwin, ExplainsThePlaneAsWell) {
  const TwoViews views = Make(true);
  const auto plane = FitPlane(views.points);
  ASSERT_TRUE(plane);
  for (const Eigen::Vector3d& point : views.points) EXPECT_NEAR(plane->dot(point), 1, 1e-6);
  const auto twin = PlaneTwin(views.b_from_a, *plane, views.ray);
  ASSERT_TRUE(twin);
  EXPECT_GT(RotationErrorDeg(*twin, views.b_from_a), 5);
  EXPECT_LT(WorstOf(views, *twin), 1e-6);
}

TEST(PlaneTwin, DoesNotExplainWhatHasDepth) {
  const TwoViews views = Make(false);
  const auto plane = FitPlane(views.points);
  ASSERT_TRUE(plane);
  const auto twin = PlaneTwin(views.b_from_a, *plane, views.ray);
  if (twin) {
    EXPECT_GT(WorstOf(views, *twin), 0.005);
  }
}

TEST(PlaneTwin, FitsThePlaneOfMost) {
  TwoViews views = Make(true);
  const auto plane = FitPlane(views.points);
  for (size_t i = 0; i < views.points.size(); i += 4) views.points[i] *= 1.5;
  const auto fitted = FitPlane(views.points);
  ASSERT_TRUE(plane && fitted);
  EXPECT_LT((*fitted - *plane).norm(), 0.02 * plane->norm());
}

TEST(PlaneTwin, IsNotThereWithoutABaselineOrAPlane) {
  const TwoViews views = Make(true);
  const auto plane = FitPlane(views.points);
  ASSERT_TRUE(plane);
  EXPECT_FALSE(PlaneTwin({views.b_from_a.rotation, Eigen::Vector3d::Zero()}, *plane, views.ray));
  const Eigen::Vector3d along = views.b_from_a.rotation * *plane;
  EXPECT_FALSE(PlaneTwin({views.b_from_a.rotation, along}, *plane, views.ray));
  EXPECT_FALSE(FitPlane(std::span(views.points).first(2)));
  const std::vector<Eigen::Vector3d> line = {{0, 0, 2}, {1, 0, 2}, {2, 0, 2}, {3, 0, 2}};
  EXPECT_FALSE(FitPlane(line));
}

}  // namespace
}  // namespace veduta
