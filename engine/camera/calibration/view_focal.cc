// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/view_focal.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <cmath>
#include <limits>

#include "engine/camera/calibration/plane_reprojection_cost.h"

namespace veduta {
namespace {

constexpr double kLossScale = 3;   // of Cauchy's loss, in sigma; chosen by hand
constexpr int kParameters = 7;     // the focal length and a pose
constexpr int kResidualsMin = 10;  // 3 more than the parameters, so that the residuals tell a sigma

}  // namespace

ViewFocal EstimateViewFocal(const std::vector<PlaneObservation>& observations,
                            const PlaneScene& scene, uint32_t view) {
  const CameraModel& c = scene.camera();
  std::array<double, kLensSize> lens = {c.fx, c.fy / c.fx, c.cx, c.cy, c.k1, c.k2, c.u0, c.v0};
  Eigen::Vector4d rotation = scene.cams_from_world[view].rotation.coeffs();
  Eigen::Vector3d translation = scene.cams_from_world[view].translation;
  ceres::CauchyLoss loss(kLossScale);
  std::vector<Eigen::Vector3d> points = scene.points;  // they do not move; Ceres wants them mutable
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  for (const PlaneObservation& o : observations) {
    if (o.view != view) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlaneReprojectionCost, 2, kLensSize, 4, 3, 3>(
            new PlaneReprojectionCost{o.px, o.sigma_px}),
        &loss, lens.data(), rotation.data(), translation.data(), points[o.point].data());
    problem.SetParameterBlockConstant(points[o.point].data());
  }
  ViewFocal estimate{c.fx, std::numeric_limits<double>::infinity()};
  if (problem.NumResiduals() < kResidualsMin) return estimate;
  problem.SetManifold(lens.data(), new ceres::SubsetManifold(kLensSize, {1, 2, 3, 4, 5, 6, 7}));
  problem.SetManifold(rotation.data(), new ceres::EigenQuaternionManifold());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable() || !(lens[0] > 0)) return estimate;

  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = {lens.data(), rotation.data(), translation.data()};
  ceres::CRSMatrix crs;
  if (!problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &crs)) return estimate;
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> jacobian(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(),
      crs.cols.data(), crs.values.data());
  const Eigen::MatrixXd dense(jacobian);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(dense.transpose() * dense);
  if (!lu.isInvertible()) return estimate;
  const double variance = 2 * summary.final_cost / (problem.NumResiduals() - kParameters);
  estimate.error_sigmas = std::sqrt(variance);
  estimate.focal_px = lens[0];
  estimate.sigma_px = std::sqrt(variance * lu.inverse()(0, 0));
  return estimate;
}

}  // namespace veduta
