// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/plane_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/camera/calibration/plane_reprojection_cost.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// height / sigma, over a point [3].
struct HeightPrior {
  double sigma;
  template <typename T>
  bool operator()(const T* point, T* residual) const {
    residual[0] = point[2] / T(sigma);
    return true;
  }
};

// (principal point - the photo's middle) / sigma, over the lens.
struct PrincipalPointPrior {
  Eigen::Vector2d middle_px;
  double sigma_px;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    residual[0] = (lens[2] - middle_px[0]) / T(sigma_px);
    residual[1] = (lens[3] - middle_px[1]) / T(sigma_px);
    return true;
  }
};

// (centre of distortion - principal point) / sigma, over the lens.
struct DistortionCenterPrior {
  double sigma_px;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    residual[0] = (lens[6] - lens[2]) / T(sigma_px);
    residual[1] = (lens[7] - lens[3]) / T(sigma_px);
    return true;
  }
};

double RmsDistanceFromMean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector3d& p : points)
    sum += (p - mean).squaredNorm() / static_cast<double>(points.size());
  return std::sqrt(sum);
}

// Two points that lie far apart: the one farthest from the mean, and the one farthest from that
// one. Their x and y are held, which fixes the scene's place, turn and scale.
std::pair<size_t, size_t> GaugePoints(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  const auto farthest = [&](const Eigen::Vector3d& from) {
    const auto nearer = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return (a - from).squaredNorm() < (b - from).squaredNorm();
    };
    return static_cast<size_t>(std::max_element(points.begin(), points.end(), nearer) -
                               points.begin());
  };
  const size_t first = farthest(mean);
  return {first, farthest(points[first])};
}

class Adjuster final {
 public:
  Adjuster(const std::vector<PlaneObservation>& observations, const PlaneAdjustmentOptions& options,
           PlaneScene* scene)
      : observations_(observations), options_(options), scene_(scene), problem_(ProblemOptions()) {}

  Result<PlaneAdjustment> Run() {
    Build();
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = Ordering();
    solver.num_threads = 1;
    solver.max_num_iterations = static_cast<int>(options_.iterations_max);
    solver.function_tolerance = options_.function_tolerance;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    if (!summary.IsSolutionUsable()) {
      return Status::InvalidArgument("calibration: the final adjustment failed: " +
                                     summary.message);
    }
    for (size_t v = 0; v < scene_->cams_from_world.size(); ++v) {
      const Eigen::Quaterniond rotation(Rotation(v));
      scene_->cams_from_world[v] = {rotation.normalized(), Eigen::Vector3d(Rotation(v) + 4)};
    }
    for (size_t i = 0; i < scene_->cameras.size(); ++i) {
      const double* const l = Lens(i);
      scene_->cameras[i] = WithIntrinsics(scene_->cameras[i],
                                          {l[0], l[0] * l[1], l[2], l[3], l[4], l[5], l[6], l[7]});
    }
    PlaneAdjustment made;
    made.covariances.assign(scene_->cameras.size(), Eigen::Matrix<double, 8, 8>::Zero());
    made.cost = summary.final_cost;
    Finish(&made);
    return made;
  }

 private:
  double* Lens(size_t camera) { return cameras_.data() + kLensSize * camera; }
  double* Rotation(size_t view) { return Lens(scene_->cameras.size()) + 7 * view; }

  static ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void Build() {
    for (const CameraModel& c : scene_->cameras)
      cameras_.insert(cameras_.end(), {c.fx, c.fy / c.fx, c.cx, c.cy, c.k1, c.k2, c.u0, c.v0});
    for (const Rigid3& pose : scene_->cams_from_world) {
      cameras_.insert(cameras_.end(), pose.rotation.coeffs().begin(), pose.rotation.coeffs().end());
      cameras_.insert(cameras_.end(), pose.translation.begin(), pose.translation.end());
    }
    auto* loss = new ceres::CauchyLoss(options_.loss_scale);
    for (const PlaneObservation& o : observations_) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PlaneReprojectionCost, 2, kLensSize, 4, 3, 3>(
              new PlaneReprojectionCost{o.px, o.sigma_px}),
          loss, Lens(scene_->CameraOf(o.view)), Rotation(o.view), Rotation(o.view) + 4,
          scene_->points[o.point].data());
    }
    for (size_t i = 0; i < scene_->cameras.size(); ++i) {
      AddLensPriors(i);
      if (!options_.is_aspect_free) problem_.SetManifold(Lens(i), &held_aspect_);
    }
    for (size_t v = 0; v < scene_->cams_from_world.size(); ++v) {
      if (problem_.HasParameterBlock(Rotation(v))) problem_.SetManifold(Rotation(v), &quaternion_);
    }
    if (options_.is_planar) {
      AddPlane();
    } else {
      HoldFirstView();
    }
  }

  void AddLensPriors(size_t camera) {
    const CameraModel& c = scene_->cameras[camera];
    const double side_px = std::max(c.width_px, c.height_px);
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DistortionCenterPrior, 2, kLensSize>(
            new DistortionCenterPrior{options_.distortion_center_sigma * side_px}),
        nullptr, Lens(camera));
    if (options_.principal_point_sigma == 0) return;
    const Eigen::Vector2d middle_px(0.5 * (c.width_px - 1), 0.5 * (c.height_px - 1));
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PrincipalPointPrior, 2, kLensSize>(
            new PrincipalPointPrior{middle_px, options_.principal_point_sigma * side_px}),
        nullptr, Lens(camera));
  }

  void AddPlane() {
    const double height_sigma = options_.plane_sigma * RmsDistanceFromMean(scene_->points);
    for (Eigen::Vector3d& point : scene_->points) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<HeightPrior, 1, 3>(new HeightPrior{height_sigma}),
          nullptr, point.data());
    }
    const auto [first, second] = GaugePoints(scene_->points);
    problem_.SetManifold(scene_->points[first].data(), &height_only_);
    problem_.SetManifold(scene_->points[second].data(), &height_only_);
  }

  // Also one number of the view that stands farthest from it: the one by which it moves most where
  // the scale changes. A point that lies far would hold the scale as badly as it is known.
  void HoldFirstView() {
    problem_.SetParameterBlockConstant(Rotation(0));
    problem_.SetParameterBlockConstant(Rotation(0) + 4);
    const std::vector<Rigid3>& views = scene_->cams_from_world;
    const auto away = [&](const Rigid3& view) -> Eigen::Vector3d {
      return view.rotation * (view.Center() - views[0].Center());
    };
    const auto nearer = [&](const Rigid3& a, const Rigid3& b) {
      return away(a).squaredNorm() < away(b).squaredNorm();
    };
    const auto farthest = std::max_element(views.begin() + 1, views.end(), nearer);
    int axis = 0;
    away(*farthest).cwiseAbs().maxCoeff(&axis);
    held_axis_ = std::make_unique<ceres::SubsetManifold>(3, std::vector<int>{axis});
    problem_.SetManifold(Rotation(static_cast<size_t>(farthest - views.begin())) + 4,
                         held_axis_.get());
  }

  std::shared_ptr<ceres::ParameterBlockOrdering> Ordering() {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Eigen::Vector3d& point : scene_->points) ordering->AddElementToGroup(point.data(), 0);
    for (double* block : CameraBlocks()) ordering->AddElementToGroup(block, 1);
    return ordering;
  }

  // The lenses first; not what is held.
  std::vector<double*> CameraBlocks() {
    std::vector<double*> blocks;
    for (size_t i = 0; i < scene_->cameras.size(); ++i) blocks.push_back(Lens(i));
    for (size_t v = options_.is_planar ? 0 : 1; v < scene_->cams_from_world.size(); ++v) {
      if (problem_.HasParameterBlock(Rotation(v)))
        blocks.insert(blocks.end(), {Rotation(v), Rotation(v) + 4});
    }
    return blocks;
  }

  void Finish(PlaneAdjustment* made) {
    ceres::Problem::EvaluateOptions evaluate;
    evaluate.apply_loss_function = false;
    evaluate.parameter_blocks = CameraBlocks();
    for (Eigen::Vector3d& point : scene_->points) evaluate.parameter_blocks.push_back(point.data());
    std::vector<double> residuals;
    ceres::CRSMatrix crs;
    if (!problem_.Evaluate(evaluate, nullptr, &residuals, nullptr, &crs)) return;
    // The scale comes from the observations alone, for the priors hold no noise.
    const size_t observed = 2 * observations_.size();
    double sum = 0;
    for (size_t i = 0; i < observed; ++i) sum += residuals[i] * residuals[i];
    // Residual blocks are evaluated in the order in which they were added.
    for (size_t i = 0; i < observations_.size(); ++i) {
      made->residuals_px.push_back(observations_[i].sigma_px *
                                   Eigen::Vector2d(residuals[2 * i], residuals[2 * i + 1]));
    }
    const double freedom = std::max(1.0, static_cast<double>(observed) - crs.num_cols);
    made->sigma_scale = std::sqrt(sum / freedom);

    const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> jacobian(
        crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(),
        crs.cols.data(), crs.values.data());
    SetCovariances(CameraInformation(jacobian.transpose() * jacobian), made);
  }

  // The normal matrix of lens and poses with the points eliminated, which is Schur's complement.
  // Empty if a point is not determined.
  Eigen::MatrixXd CameraInformation(const Eigen::SparseMatrix<double>& normal) {
    Eigen::Index first = normal.cols();
    for (Eigen::Vector3d& p : scene_->points) first -= problem_.ParameterBlockTangentSize(p.data());
    Eigen::MatrixXd information = normal.topLeftCorner(first, first);
    Eigen::Index at = first;
    for (Eigen::Vector3d& p : scene_->points) {
      const Eigen::Index size = problem_.ParameterBlockTangentSize(p.data());
      const Eigen::MatrixXd own = normal.block(at, at, size, size);
      const Eigen::SparseMatrix<double> with_cameras = normal.block(0, at, first, size);
      const Eigen::LLT<Eigen::MatrixXd> llt(own);
      if (llt.info() != Eigen::Success) return {};
      const Eigen::SparseMatrix<double> inverse =
          llt.solve(Eigen::MatrixXd::Identity(size, size)).eval().sparseView();
      const Eigen::SparseMatrix<double> taken = with_cameras * inverse * with_cameras.transpose();
      information -= taken;
      at += size;
    }
    return information;
  }

  // The covariance of each lens's free parameters is a part of the inverse of the information;
  // their derivatives then give the covariance of the intrinsics.
  void SetCovariances(Eigen::MatrixXd information, PlaneAdjustment* made) {
    if (information.size() == 0) return;
    const Eigen::VectorXd scale = information.diagonal().cwiseMax(0).cwiseSqrt();
    constexpr double kPivotMin = 1e-13;  // of a matrix with a unit diagonal; less is rounding
    if (!(scale.minCoeff() > 0)) return;
    information =
        scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(information);
    if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > kPivotMin)) return;
    std::vector<int> free = {0, 1, 2, 3, 4, 5, 6, 7};
    if (!options_.is_aspect_free) free.erase(free.begin() + 1);
    const auto n = static_cast<Eigen::Index>(free.size());
    const auto lenses = static_cast<Eigen::Index>(scene_->cameras.size());
    const Eigen::MatrixXd inverse =
        ldlt.solve(Eigen::MatrixXd::Identity(information.rows(), n * lenses)).topRows(n * lenses);
    made->is_determined = true;
    for (Eigen::Index i = 0; i < lenses; ++i) {
      const double* const lens = Lens(static_cast<size_t>(i));
      // fx = f, fy = f * aspect.
      Eigen::MatrixXd intrinsics_by_free = Eigen::MatrixXd::Zero(8, n);
      for (Eigen::Index column = 0; column < n; ++column) {
        const int of_lens = free[static_cast<size_t>(column)];
        if (of_lens == 0)
          intrinsics_by_free(0, column) = 1, intrinsics_by_free(1, column) = lens[1];
        if (of_lens == 1) intrinsics_by_free(1, column) = lens[0];
        if (of_lens >= 2) intrinsics_by_free(of_lens, column) = 1;
        intrinsics_by_free.col(column) /= scale[i * n + column];
      }
      Eigen::Matrix<double, 8, 8>& covariance = made->covariances[static_cast<size_t>(i)];
      covariance = made->sigma_scale * made->sigma_scale * intrinsics_by_free *
                   inverse.block(i * n, i * n, n, n) * intrinsics_by_free.transpose();
      made->is_determined =
          made->is_determined && covariance.allFinite() && covariance.diagonal().minCoeff() >= 0;
    }
  }

  const std::vector<PlaneObservation>& observations_;
  const PlaneAdjustmentOptions options_;
  PlaneScene* const scene_;
  // The lenses, then each view's rotation (x y z w) and translation: in one array, because Ceres
  // orders parameter blocks by their addresses.
  std::vector<double> cameras_;
  ceres::EigenQuaternionManifold quaternion_;
  ceres::SubsetManifold height_only_{3, {0, 1}};
  ceres::SubsetManifold held_aspect_{kLensSize, {1}};
  std::unique_ptr<ceres::SubsetManifold> held_axis_;
  ceres::Problem problem_;  // refers to the members above, and so must be destroyed before them
};

}  // namespace

std::array<double, 8> IntrinsicsOf(const CameraModel& m) {
  return {m.fx, m.fy, m.cx, m.cy, m.k1, m.k2, m.u0, m.v0};
}

CameraModel WithIntrinsics(CameraModel model, const std::array<double, 8>& values) {
  model.fx = values[0];
  model.fy = values[1];
  model.cx = values[2];
  model.cy = values[3];
  model.k1 = values[4];
  model.k2 = values[5];
  model.u0 = values[6];
  model.v0 = values[7];
  return model;
}

Status PlaneAdjustmentOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("plane_sigma", plane_sigma, 0)
      .FiniteAbove("distortion_center_sigma", distortion_center_sigma, 0)
      .Between("principal_point_sigma", principal_point_sigma, 0, 1)
      .FiniteAbove("loss_scale", loss_scale, 0)
      .Between("iterations_max", iterations_max, 1, 1'000'000)
      .FiniteAbove("function_tolerance", function_tolerance, 0)
      .status();
}

Result<PlaneAdjustment> AdjustPlane(const std::vector<PlaneObservation>& observations,
                                    const PlaneAdjustmentOptions& options, PlaneScene* scene) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const size_t views_min = options.is_planar ? 1 : 2;
  if (scene->points.size() < 2 || scene->cams_from_world.size() < views_min)
    return Status::InvalidArgument("calibration: fewer than 2 points to adjust, or too few views");
  return Adjuster(observations, options, scene).Run();
}

}  // namespace veduta
