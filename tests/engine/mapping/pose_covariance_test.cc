// SPDX-License-Identifier: Apache-2.0
// Goal: the covariance of a pose is the inverse of its normal equations, and says how far poses
//   really are from the truth.
// Method: normal equations from a numerical Jacobian by pose and points; poses adjusted to many
//   draws of noise, whose errors are compared with what each draw's covariance expects.
#include "engine/mapping/pose_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/mapping/bundle_solver.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

// Pose 0 is free; the points that it sees, as all cameras see them, but of each third point only
// pose 0 and the last one that sees it.
BundleProblem ProblemOf(const SyntheticScene& scene) {
  BundleProblem problem;
  problem.free_count = 1;
  for (size_t k = 0; k < scene.poses.size(); ++k) {
    problem.cams_from_world.push_back(scene.poses[k]);
    problem.cameras.push_back(scene.camera);
  }
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (scene.feature_of[0][i] < 0) continue;
    problem.points.push_back(scene.points[i]);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (uint32_t k = 0; k < scene.poses.size(); ++k) {
      if (scene.feature_of[k][i] < 0) continue;
      const Keypoint& seen =
          scene.images[k].features->keypoints[static_cast<size_t>(scene.feature_of[k][i])];
      if (i % 3 == 0 && problem.observations.size() > problem.first_observation.back() + 1)
        problem.observations.pop_back();
      problem.observations.push_back({k, {seen.x_px, seen.y_px}});
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

// (omega, d) moves the rotation on the left, and the centre.
Rigid3 Moved(const Rigid3& pose, const Vector6d& by) {
  Rigid3 moved;
  moved.rotation = pose.rotation;
  const double angle = by.head<3>().norm();
  if (angle > 0)
    moved.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, by.head<3>() / angle)) * pose.rotation;
  moved.translation = -(moved.rotation * (pose.Center() + by.tail<3>()));
  return moved;
}

Eigen::VectorXd Errors(const BundleProblem& problem, const Eigen::VectorXd& by) {
  const Rigid3 pose = Moved(problem.cams_from_world[0], by.head<6>());
  Eigen::VectorXd errors(2 * static_cast<Eigen::Index>(problem.observations.size()));
  for (uint32_t i = 0; i < problem.points.size(); ++i) {
    const Eigen::Vector3d point = problem.points[i] + by.segment<3>(6 + 3 * i);
    for (uint32_t o = problem.first_observation[i]; o < problem.first_observation[i + 1]; ++o) {
      const BundleObservation& seen = problem.observations[o];
      const Rigid3& cam = seen.image == 0 ? pose : problem.cams_from_world[seen.image];
      errors.segment<2>(2 * o) = problem.cameras[seen.image].Project(cam * point) - seen.x_px;
    }
  }
  return errors;
}

TEST(PoseCovariance, IsTheInverseOfTheNormalEquations) {
  SceneOptions options;
  options.camera_count = 4;
  options.point_count = 25;
  options.noise_px = 0.8;
  const BundleProblem problem = ProblemOf(MakeScene(options));
  BundleOptions bundle;
  bundle.loss_scale_px = 1.5;
  bundle.two_view_weight = 0.3;
  const auto covariance = CovarianceOfPose(problem, bundle);
  ASSERT_TRUE(covariance);

  const Eigen::Index columns = 6 + 3 * static_cast<Eigen::Index>(problem.points.size());
  const Eigen::VectorXd errors = Errors(problem, Eigen::VectorXd::Zero(columns));
  Eigen::MatrixXd jacobian(errors.size(), columns);
  for (Eigen::Index k = 0; k < columns; ++k) {
    const Eigen::VectorXd step = 1e-6 * Eigen::VectorXd::Unit(columns, k);
    jacobian.col(k) = (Errors(problem, step) - Errors(problem, -step)) / 2e-6;
  }
  Eigen::VectorXd squared_weights(errors.size());
  double squares = 0;
  for (Eigen::Index o = 0; o < errors.size(); o += 2) {
    const double square = errors.segment<2>(o).squaredNorm();
    const double weight = 1 / (1 + square / (bundle.loss_scale_px * bundle.loss_scale_px));
    squared_weights[o] = squared_weights[o + 1] = weight * weight;
    squares += weight * weight * square;
  }
  Eigen::VectorXd of_points(errors.size());
  for (uint32_t i = 0; i < problem.points.size(); ++i) {
    const uint32_t first = problem.first_observation[i], end = problem.first_observation[i + 1];
    of_points.segment(2 * first, 2 * (end - first)).setConstant(end - first == 2 ? 0.3 : 1);
  }
  const auto normal = [&](const Eigen::VectorXd& weights) -> Eigen::MatrixXd {
    return jacobian.transpose() * weights.cwiseProduct(squared_weights).asDiagonal() * jacobian;
  };
  const Eigen::MatrixXd inverse = normal(of_points).inverse();
  const Eigen::MatrixXd unscaled = inverse * normal(of_points.cwiseAbs2()) * inverse;
  const double variance = squares / static_cast<double>(errors.size() - columns);
  const double mean = squared_weights.mean();
  const double spread = (squared_weights.array() - mean).square().mean() / (mean * mean);
  const double correction =
      1 + static_cast<double>(columns) / static_cast<double>(errors.size()) * spread;
  const Matrix6d expected =
      correction * variance / squared_weights.mean() * unscaled.topLeftCorner<6, 6>();
  const Vector6d scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d difference =
      scale.asDiagonal() * (covariance->covariance - expected) * scale.asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(covariance->error_px, std::sqrt(variance) / squared_weights.mean(), 1e-9);
  EXPECT_EQ(covariance->covariance, covariance->covariance.transpose());
}

// The mean of d' C^-1 d over draws of noise is 6 where C is the covariance of d.
TEST(PoseCovariance, SaysHowFarPosesAreFromTheTruth) {
  struct Case {
    double noise_px;
    uint32_t cameras;
  };
  for (const auto& [noise_px, cameras] : {Case{0.3, 3}, {0.3, 10}, {0.5, 5}, {0.7, 10}}) {
    constexpr int kDraws = 300;
    double sum = 0, error_px_sum = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      SceneOptions options;
      options.camera_count = cameras;
      options.point_count = 80;
      options.noise_px = noise_px;
      options.seed = static_cast<uint64_t>(draw) + 1;
      const SyntheticScene scene = MakeScene(options);
      BundleProblem problem = ProblemOf(scene);
      BundleOptions bundle;
      bundle.function_tolerance = 1e-10;
      bundle.iterations_max = 100;
      ASSERT_TRUE(SolveBundle(bundle, nullptr, &problem).is_usable);
      const auto covariance = CovarianceOfPose(problem, bundle);
      ASSERT_TRUE(covariance);
      const Rigid3 &pose = problem.cams_from_world[0], &truth = scene.poses[0];
      const Eigen::AngleAxisd turn(truth.rotation * pose.rotation.conjugate());
      Vector6d error;
      error << turn.angle() * turn.axis(), truth.Center() - pose.Center();
      sum += error.dot(covariance->covariance.llt().solve(error)) / kDraws;
      error_px_sum += covariance->error_px / kDraws;
    }
    // The mean of 300 such sums of six squares has a standard deviation of sqrt(12 / 300) = 0.2.
    EXPECT_NEAR(sum, 6, 0.9) << noise_px << " px, " << cameras << " cameras";
    EXPECT_NEAR(error_px_sum, noise_px, 0.2 * noise_px) << noise_px;
  }
}

TEST(PoseCovariance, FewerPointsAreLessSure) {
  SceneOptions options;
  options.point_count = 400;
  const auto many = CovarianceOfPose(ProblemOf(MakeScene(options)), BundleOptions());
  options.point_count = 40;
  const auto few = CovarianceOfPose(ProblemOf(MakeScene(options)), BundleOptions());
  ASSERT_TRUE(many && few);
  const double ratio = few->covariance.trace() / many->covariance.trace();
  EXPECT_GT(ratio, 5);
  EXPECT_LT(ratio, 20);  // about ten
}

TEST(PoseCovariance, AnUndeterminedPoseHasNone) {
  EXPECT_FALSE(CovarianceOfPose({}, BundleOptions()));
  SceneOptions options;
  options.point_count = 3;
  options.camera_count = 2;
  EXPECT_FALSE(CovarianceOfPose(ProblemOf(MakeScene(options)), BundleOptions()));  // no redundancy
  // Points in one line before the camera leave its rotation around them free.
  options.point_count = 30;
  options.noise_px = 0;
  SyntheticScene scene = MakeScene(options);
  BundleProblem problem = ProblemOf(scene);
  for (size_t i = 0; i < problem.points.size(); ++i)
    problem.points[i] = Eigen::Vector3d(0.05 * static_cast<double>(i) - 0.7, 0, 0);
  for (uint32_t i = 0; i < problem.points.size(); ++i) {
    for (uint32_t o = problem.first_observation[i]; o < problem.first_observation[i + 1]; ++o) {
      BundleObservation& seen = problem.observations[o];
      seen.x_px = scene.camera.Project(problem.cams_from_world[seen.image] * problem.points[i]);
      seen.x_px.x() += 0.1 * (o % 2);
    }
  }
  EXPECT_FALSE(CovarianceOfPose(problem, BundleOptions()));
}

}  // namespace
}  // namespace veduta
