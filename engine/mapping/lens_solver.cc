// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/lens_solver.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>
#include <memory>

namespace veduta {
namespace {

// Changes are at most so large: what goes further is no lens that is seen better. Chosen by hand.
constexpr double kChangeMax[kLensValueCount] = {0.25, 0.2, 0.2};
// Steps tried. Chosen by hand.
constexpr int kIterationsMax = 30;

// A pose as Ceres has it: x, y, z, w of the unit quaternion, and the translation.
using PoseValues = std::array<double, 7>;

template <typename T>
Eigen::Matrix<T, 3, 1> InCamera(const T* pose, const T* point) {
  const Eigen::Map<const Eigen::Quaternion<T>> rotation(pose);
  const Eigen::Map<const Eigen::Matrix<T, 3, 1>> translation(pose + 4), position(point);
  return rotation * position + translation;
}

// Of an image whose camera is held.
struct ReprojectionCost {
  Pinhole camera;
  Eigen::Vector2d x_px;

  template <typename T>
  bool operator()(const T* pose, const T* point, T* error) const {
    const Eigen::Matrix<T, 3, 1> x_cam = InCamera(pose, point);
    if (x_cam.z() < T(1e-9)) return false;
    error[0] = camera.fx * x_cam.x() / x_cam.z() + camera.cx - x_px.x();
    error[1] = camera.fy * x_cam.y() / x_cam.z() + camera.cy - x_px.y();
    return true;
  }
};

struct LensReprojectionCost {
  const CameraModel& lens;
  Eigen::Vector2d x_px;

  template <typename T>
  bool operator()(const T* pose, const T* point, const T* change, T* error) const {
    const Eigen::Matrix<T, 3, 1> x_cam = InCamera(pose, point);
    if (x_cam.z() < T(1e-9)) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> to(error);
    to = ProjectThroughLens(lens, change, x_cam);
    error[0] -= x_px.x(), error[1] -= x_px.y();
    return true;
  }
};

struct PriorCost {
  template <typename T>
  bool operator()(const T* change, T* error) const {
    for (int i = 0; i < kLensValueCount; ++i) error[i] = change[i] / kLensPriorSigmas[i];
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
  std::vector<LensChange> changes;
};

void AddObservations(const BundleProblem& problem, const BundleOptions& options,
                     const BundleLenses& lenses, ceres::LossFunction* loss, Values* values,
                     ceres::Problem* to) {
  auto* const for_two =
      new ceres::ScaledLoss(loss, options.two_view_weight, ceres::DO_NOT_TAKE_OWNERSHIP);
  for (size_t p = 0; p < problem.points.size(); ++p) {
    ceres::LossFunction* const counts = PointWeight(problem, p, options) == 1.0 ? loss : for_two;
    for (uint32_t o = problem.first_observation[p]; o < problem.first_observation[p + 1]; ++o) {
      const BundleObservation& seen = problem.observations[o];
      double* const pose = values->poses[seen.image].data();
      double* const point = values->points[p].data();
      if (const auto lens = lenses.of_image[seen.image]) {
        using Cost = ceres::AutoDiffCostFunction<LensReprojectionCost, 2, 7, 3, kLensValueCount>;
        to->AddResidualBlock(new Cost(new LensReprojectionCost{lenses.models[*lens], seen.x_px}),
                             counts, pose, point, values->changes[*lens].data());
      } else {
        using Cost = ceres::AutoDiffCostFunction<ReprojectionCost, 2, 7, 3>;
        to->AddResidualBlock(new Cost(new ReprojectionCost{problem.cameras[seen.image], seen.x_px}),
                             counts, pose, point);
      }
    }
  }
}

}  // namespace

std::optional<std::vector<LensChange>> SolveWithLenses(const BundleOptions& options,
                                                       const BundleLenses& lenses,
                                                       BundleProblem* problem) {
  Values values;
  for (const Rigid3& pose : problem->cams_from_world) values.poses.push_back(ValuesOf(pose));
  values.points = problem->points;
  values.changes.assign(lenses.models.size(), LensChange::Zero());

  ceres::Problem ceres_problem;
  auto* const loss = new ceres::CauchyLoss(options.loss_scale_px);
  AddObservations(*problem, options, lenses, loss, &values, &ceres_problem);
  auto* const manifold =
      new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseValues& pose : values.poses) {
    ceres_problem.SetManifold(pose.data(), manifold);
    ordering->AddElementToGroup(pose.data(), 1);
  }
  ceres_problem.SetParameterBlockConstant(values.poses.back().data());
  for (Eigen::Vector3d& point : values.points) ordering->AddElementToGroup(point.data(), 0);
  for (size_t lens = 0; lens < values.changes.size(); ++lens) {
    LensChange& change = values.changes[lens];
    using Cost = ceres::AutoDiffCostFunction<PriorCost, kLensValueCount, kLensValueCount>;
    ceres_problem.AddResidualBlock(new Cost(new PriorCost), nullptr, change.data());
    // A group of their own: within one, Ceres goes by addresses, and those are not always alike.
    ordering->AddElementToGroup(change.data(), 2);
    for (int i = 0; i < kLensValueCount; ++i) {
      ceres_problem.SetParameterLowerBound(change.data(), i, -kChangeMax[i]);
      ceres_problem.SetParameterUpperBound(change.data(), i, kChangeMax[i]);
    }
    if (lens < lenses.keeps_distortion.size() && lenses.keeps_distortion[lens]) {
      ceres_problem.SetManifold(change.data(), new ceres::SubsetManifold(kLensValueCount, {1, 2}));
    }
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
  if (!summary.IsSolutionUsable()) return std::nullopt;
  for (size_t i = 0; i < values.poses.size(); ++i)
    problem->cams_from_world[i] = PoseOf(values.poses[i]);
  problem->points = values.points;
  return values.changes;
}

}  // namespace veduta
