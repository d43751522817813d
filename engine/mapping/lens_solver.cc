// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/lens_solver.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>
#include <memory>

namespace veduta {
namespace {

// The logarithm of a factor is at most so large: what goes further is no lens that is seen better.
// Chosen by hand.
constexpr double kLogFactorMax = 0.25;
// Steps tried. Chosen by hand.
constexpr int kIterationsMax = 30;

// A pose as Ceres has it: x, y, z, w of the unit quaternion, and the translation.
using PoseValues = std::array<double, 7>;

struct ReprojectionCost {
  Pinhole camera;
  Eigen::Vector2d x_px;

  template <typename T>
  bool operator()(const T* pose, const T* point, const T* log_factor, T* error) const {
    const Eigen::Map<const Eigen::Quaternion<T>> rotation(pose);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> translation(pose + 4), position(point);
    const Eigen::Matrix<T, 3, 1> x_cam = rotation * position + translation;
    if (x_cam.z() < T(1e-9)) return false;
    const T factor = exp(*log_factor);
    error[0] = camera.fx * factor * x_cam.x() / x_cam.z() + camera.cx - x_px.x();
    error[1] = camera.fy * factor * x_cam.y() / x_cam.z() + camera.cy - x_px.y();
    return true;
  }
};

struct PriorCost {
  template <typename T>
  bool operator()(const T* log_factor, T* error) const {
    *error = *log_factor / kLensFocalShare;
    return true;
  }
};

PoseValues ValuesOf(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Rigid3 PoseOf(const PoseValues& values) {
  return {Eigen::Quaterniond(values[3], values[0], values[1], values[2]).normalized(),
          {values[4], values[5], values[6]}};
}

// The values that Ceres works on.
struct Values {
  std::vector<PoseValues> poses;
  std::vector<Eigen::Vector3d> points;
  std::vector<double> logs;  // of the factors; the last is 0 and belongs to all that stay
};

void AddObservations(const BundleProblem& problem, const BundleOptions& options,
                     std::span<const std::optional<uint32_t>> lens_of, ceres::LossFunction* loss,
                     Values* values, ceres::Problem* to) {
  auto* const for_two =
      new ceres::ScaledLoss(loss, options.two_view_weight, ceres::DO_NOT_TAKE_OWNERSHIP);
  to->AddParameterBlock(&values->logs.back(), 1);  // there even where all lenses are refined
  for (size_t p = 0; p < problem.points.size(); ++p) {
    const bool counts_whole = PointWeight(problem, p, options) == 1.0;
    for (uint32_t o = problem.first_observation[p]; o < problem.first_observation[p + 1]; ++o) {
      const BundleObservation& seen = problem.observations[o];
      double* const log = &values->logs[lens_of[seen.image].value_or(values->logs.size() - 1)];
      to->AddResidualBlock(new ceres::AutoDiffCostFunction<ReprojectionCost, 2, 7, 3, 1>(
                               new ReprojectionCost{problem.cameras[seen.image], seen.x_px}),
                           counts_whole ? loss : for_two, values->poses[seen.image].data(),
                           values->points[p].data(), log);
    }
  }
}

}  // namespace

bool SolveWithLenses(const BundleOptions& options, std::span<const std::optional<uint32_t>> lens_of,
                     BundleProblem* problem, std::span<double> factors) {
  Values values;
  for (const Rigid3& pose : problem->cams_from_world) values.poses.push_back(ValuesOf(pose));
  values.points = problem->points;
  values.logs.assign(factors.size() + 1, 0.0);

  ceres::Problem ceres_problem;
  auto* const loss = new ceres::CauchyLoss(options.loss_scale_px);
  AddObservations(*problem, options, lens_of, loss, &values, &ceres_problem);
  ceres_problem.SetParameterBlockConstant(&values.logs.back());
  auto* const manifold =
      new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseValues& pose : values.poses) {
    ceres_problem.SetManifold(pose.data(), manifold);
    ordering->AddElementToGroup(pose.data(), 1);
  }
  ceres_problem.SetParameterBlockConstant(values.poses.back().data());
  for (Eigen::Vector3d& point : values.points) ordering->AddElementToGroup(point.data(), 0);
  // A group of their own: within one, Ceres goes by the addresses, and those are not always alike.
  for (double& log : values.logs) ordering->AddElementToGroup(&log, 2);
  for (size_t i = 0; i < factors.size(); ++i) {
    ceres_problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorCost, 1, 1>(new PriorCost),
                                   nullptr, &values.logs[i]);
    ceres_problem.SetParameterLowerBound(&values.logs[i], 0, -kLogFactorMax);
    ceres_problem.SetParameterUpperBound(&values.logs[i], 0, kLogFactorMax);
  }

  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;  // more would add in another order each time
  solver.max_num_iterations = kIterationsMax;
  solver.function_tolerance = options.function_tolerance;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  if (!summary.IsSolutionUsable()) return false;
  for (size_t i = 0; i < values.poses.size(); ++i)
    problem->cams_from_world[i] = PoseOf(values.poses[i]);
  problem->points = values.points;
  for (size_t i = 0; i < factors.size(); ++i) factors[i] = std::exp(values.logs[i]);
  return true;
}

}  // namespace veduta
