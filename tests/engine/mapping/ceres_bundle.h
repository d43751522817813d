// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bundle adjustment by Ceres, the reference that ours is compared with.

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/bundle_problem.h"

namespace veduta {

// A pose as Ceres sees it: quaternion x y z w, then translation. Its tangent is a rotation vector
// in the camera frame, applied on the left, then the change of translation.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  // [I; 0]: the cost function writes derivatives by the tangent into the first six columns and zero
  // into the last, which saves the chain rule through the quaternion.
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// ReprojectionError (bundle_problem.h) over pose [7] and point [3].
class ReprojectionCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const Pinhole& camera, const Eigen::Vector2d& x_px)
      : camera_(camera), x_px_(x_px) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Pinhole camera_;
  const Eigen::Vector2d x_px_;
};

// The same with the pose held, over the point [3] alone.
class FixedPoseReprojectionCost final : public ceres::SizedCostFunction<2, 3> {
 public:
  FixedPoseReprojectionCost(const Rigid3& cam_from_world, const Pinhole& camera,
                            const Eigen::Vector2d& x_px)
      : rotation_(cam_from_world.rotation.toRotationMatrix()),
        translation_(cam_from_world.translation),
        camera_(camera),
        x_px_(x_px) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const Eigen::Matrix3d rotation_;
  const Eigen::Vector3d translation_;
  const Pinhole camera_;
  const Eigen::Vector2d x_px_;
};

inline Rigid3 PoseOf(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(block)),
          Eigen::Map<const Eigen::Vector3d>(block + 4)};
}

inline bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Rigid3 moved = MovePose(PoseOf(x), Eigen::Map<const Vector6d>(delta));
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = moved.rotation;
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + 4} = moved.translation;
  return true;
}

inline bool PoseManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.topRows<6>().setIdentity();
  return true;
}

inline bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::AngleAxisd turn(PoseOf(y).rotation * PoseOf(x).rotation.conjugate());
  Eigen::Map<Eigen::Vector3d>{y_minus_x} = turn.angle() * turn.axis();
  for (int i = 0; i < 3; ++i) y_minus_x[3 + i] = y[4 + i] - x[4 + i];
  return true;
}

inline bool PoseManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
  j.setZero();
  j.leftCols<6>().setIdentity();
  return true;
}

inline bool ReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                       double** jacobians) const {
  const Rigid3 pose = PoseOf(parameters[0]);
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  const Eigen::Vector3d rotated = rotation * Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  Matrix23d by_cam;
  Eigen::Map<Eigen::Vector2d>{residuals} =
      ReprojectionError(camera_, rotated + pose.translation, x_px_, &by_cam);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
    Eigen::Matrix3d turn;  // derivative of the rotated point by the rotation vector: -[R X]x
    turn << 0, rotated.z(), -rotated.y(), -rotated.z(), 0, rotated.x(), rotated.y(), -rotated.x(),
        0;
    by_pose.leftCols<3>() = by_cam * turn;
    by_pose.middleCols<3>(3) = by_cam;
    by_pose.col(6).setZero();
  }
  if (jacobians[1] != nullptr) Eigen::Map<Matrix23d>{jacobians[1]} = by_cam * rotation;
  return true;
}

inline bool FixedPoseReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                                double** jacobians) const {
  const Eigen::Map<const Eigen::Vector3d> point(parameters[0]);
  Matrix23d by_cam;
  Eigen::Map<Eigen::Vector2d>{residuals} =
      ReprojectionError(camera_, rotation_ * point + translation_, x_px_, &by_cam);
  if (jacobians != nullptr && jacobians[0] != nullptr)
    Eigen::Map<Matrix23d>{jacobians[0]} = by_cam * rotation_;
  return true;
}

using PoseBlock = std::array<double, 7>;

inline PoseBlock ToBlock(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {
      q.x(), q.y(), q.z(), q.w(), pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

inline Rigid3 FromBlock(const PoseBlock& block) {
  return {Eigen::Quaterniond(block[3], block[0], block[1], block[2]).normalized(),
          {block[4], block[5], block[6]}};
}

// As SolveBundle.
inline BundleSolution SolveByCeres(const BundleOptions& options, BundleProblem* problem) {
  std::vector<PoseBlock> poses;
  for (uint32_t i = 0; i < problem->free_count; ++i)
    poses.push_back(ToBlock(problem->cams_from_world[i]));
  std::vector<Eigen::Vector3d> points = problem->points;

  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  PoseManifold manifold;
  ceres::Problem costs(problem_options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  // The problem owns the costs and these losses, but not the loss that both scale.
  ceres::CauchyLoss cauchy(options.loss_scale_px);
  const auto scaled = [&](double weight) {
    return new ceres::ScaledLoss(&cauchy, weight, ceres::DO_NOT_TAKE_OWNERSHIP);
  };
  ceres::LossFunction* const of_many = scaled(1);
  ceres::LossFunction* const of_two = scaled(options.two_view_weight);
  for (size_t i = 0; i < points.size(); ++i) {
    const bool is_of_two = problem->first_observation[i + 1] - problem->first_observation[i] == 2;
    ceres::LossFunction* const loss = is_of_two ? of_two : of_many;
    for (uint32_t o = problem->first_observation[i]; o < problem->first_observation[i + 1]; ++o) {
      const auto& [image, x_px] = problem->observations[o];
      const Pinhole& camera = problem->cameras[image];
      if (image < problem->free_count) {
        costs.AddResidualBlock(new ReprojectionCost(camera, x_px), loss, poses[image].data(),
                               points[i].data());
      } else {
        costs.AddResidualBlock(
            new FixedPoseReprojectionCost(problem->cams_from_world[image], camera, x_px), loss,
            points[i].data());
      }
    }
    ordering->AddElementToGroup(points[i].data(), 0);
  }
  for (PoseBlock& block : poses) {
    costs.SetManifold(block.data(), &manifold);
    ordering->AddElementToGroup(block.data(), 1);
  }

  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;
  solver.max_num_iterations = static_cast<int>(options.iterations_max);
  solver.function_tolerance = options.function_tolerance;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(solver, &costs, &solved);
  const BundleSolution solution{solved.IsSolutionUsable(),
                                static_cast<uint32_t>(solved.iterations.size()) - 1,
                                solved.initial_cost, solved.final_cost};
  if (solution.is_usable) {
    for (uint32_t i = 0; i < problem->free_count; ++i)
      problem->cams_from_world[i] = FromBlock(poses[i]);
    problem->points = std::move(points);
  }
  return solution;
}

}  // namespace veduta
