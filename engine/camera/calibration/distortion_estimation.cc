// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/distortion_estimation.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Pairs = std::set<std::pair<uint32_t, uint32_t>>;  // of views

constexpr int kIterationsMax = 60;  // of Levenberg and Marquardt's; chosen by hand

// One adjacent homography on the way from view i to view j.
struct Step {
  uint32_t child = 0;         // the homography is view_from_parent[child]
  bool to_the_child = false;  // false: against its direction
};

// From i up to the common ancestor and down to j.
std::vector<Step> PathBetween(const ViewTree& tree, uint32_t i, uint32_t j) {
  std::vector<uint32_t> above_i = {i};
  while (above_i.back() != tree.root) above_i.push_back(tree.parent[above_i.back()]);
  std::vector<Step> down;
  auto meet = above_i.end();
  for (uint32_t v = j;; v = tree.parent[v]) {
    meet = std::find(above_i.begin(), above_i.end(), v);
    if (meet != above_i.end()) break;
    down.push_back({v, true});
  }
  std::vector<Step> path;
  for (auto v = above_i.begin(); v != meet; ++v) path.push_back({*v, false});
  path.insert(path.end(), down.rbegin(), down.rend());
  return path;
}

// One point's term of equation 1, over theta [4] = (u0, v0, k1, k2) and the homographies [9] of the
// path.
class TransferCost {
 public:
  TransferCost(std::vector<Step> path, const Eigen::Vector2d& x_i, const Eigen::Vector2d& x_j,
               double sigma)
      : path_(std::move(path)), x_i_(x_i), x_j_(x_j), sigma_(sigma) {}

  template <typename T>
  bool operator()(T const* const* parameters, T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Vector2 = Eigen::Matrix<T, 2, 1>;
    const T* const theta = parameters[0];
    const Vector2 center(theta[0], theta[1]);
    Vector3 p = Undistort(theta, center, x_i_).homogeneous();
    for (size_t s = 0; s < path_.size(); ++s) {
      const Eigen::Map<const Eigen::Matrix<T, 3, 3, Eigen::RowMajor>> h(parameters[1 + s]);
      if (path_[s].to_the_child) {
        p = h * p;
      } else {  // the adjugate is the inverse up to scale
        const Vector3 row0 = h.row(0), row1 = h.row(1), row2 = h.row(2);
        p = row1.cross(row2) * p[0] + row2.cross(row0) * p[1] + row0.cross(row1) * p[2];
      }
    }
    if (p[2] == T(0)) return false;
    const Vector2 error = (Undistort(theta, center, x_j_) - p.hnormalized()) / T(sigma_);
    // J^-1 = I / g + d d^T (1/g' - 1/g) / r^2, with g = 1 + k1 r^2 + k2 r^4 and g' its derivative
    // times r, plus g.
    const Vector2 d = x_j_.template cast<T>() - center;
    const T r2 = d.squaredNorm();
    const T across = T(1) + r2 * (theta[2] + theta[3] * r2);
    const T along = T(1) + r2 * (T(3) * theta[2] + T(5) * theta[3] * r2);
    // Nearly folded over, or beyond: Ceres then tries a smaller step. 0.05 is chosen by hand.
    if (!(across > T(0.05)) || !(along > T(0.05))) return false;
    const Vector2 in_photo =
        error / across -
        d * (d.dot(error) * (T(2) * theta[2] + T(4) * theta[3] * r2) / (across * along));
    residual[0] = in_photo[0];
    residual[1] = in_photo[1];
    return true;
  }

 private:
  template <typename T>
  static Eigen::Matrix<T, 2, 1> Undistort(const T* theta, const Eigen::Matrix<T, 2, 1>& center,
                                          const Eigen::Vector2d& x) {
    const Eigen::Matrix<T, 2, 1> d = x.template cast<T>() - center;
    const T r2 = d.squaredNorm();
    return center + d * (T(1) + r2 * (theta[2] + theta[3] * r2));
  }

  const std::vector<Step> path_;
  const Eigen::Vector2d x_i_, x_j_;
  const double sigma_;
};

// The prior of theta: what is thought of it before any photo is seen.
struct ThetaPrior {
  double center_sigma, coefficient_sigma;
  template <typename T>
  bool operator()(const T* theta, T* residual) const {
    for (int k = 0; k < 4; ++k)
      residual[k] = theta[k] / T(k < 2 ? center_sigma : coefficient_sigma);
    return true;
  }
};

// The adjacent pairs of the tree, and for each view the `extra_pairs` others that it shares most
// points with.
Pairs ChoosePairs(const std::vector<PlanarView>& views, const ViewTree& tree,
                  uint32_t extra_pairs) {
  Pairs pairs;
  for (const uint32_t v : tree.order) {
    if (v != tree.root) pairs.insert(std::minmax(v, tree.parent[v]));
  }
  for (const uint32_t v : tree.order) {
    std::vector<std::pair<size_t, uint32_t>> others;
    for (const uint32_t w : tree.order) {
      const size_t common = v == w ? 0 : CommonPoints(views[v], views[w]).size();
      if (common > 0 && !pairs.contains(std::minmax(v, w))) others.emplace_back(common, w);
    }
    std::sort(others.rbegin(), others.rend());
    for (size_t i = 0; i < std::min<size_t>(extra_pairs, others.size()); ++i) {
      pairs.insert(std::minmax(v, others[i].second));
    }
  }
  return pairs;
}

// Sigmas are relative, while the loss is in the photo's units: all sigmas are brought to the mean.
double MeanSigma(const std::vector<PlanarView>& views, const ViewTree& tree) {
  double sum = 0, count = 0;
  for (const uint32_t v : tree.order) {
    for (const PlanarPoint& p : views[v]) sum += p.sigma, count += 1;
  }
  return sum / std::max(count, 1.0);
}

class Estimator final {
 public:
  Estimator(const std::vector<PlanarView>& views, const DistortionOptions& options, ViewTree* tree)
      : views_(views), options_(options), tree_(tree) {}

  Result<DistortionEstimate> Run() {
    SetStart();
    AddResiduals();
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    solver.num_threads = 1;
    solver.max_num_iterations = kIterationsMax;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    if (!summary.IsSolutionUsable()) {
      return Status::InvalidArgument("calibration: the distortion cannot be estimated: " +
                                     summary.message);
    }
    for (const uint32_t v : tree_->order) {
      if (v != tree_->root)
        tree_->view_from_parent[v] = Eigen::Map<const RowMatrix3>(Homography(v));
    }
    const double* const theta = Theta();
    return DistortionEstimate{{{theta[0], theta[1]}, theta[2], theta[3]}, MedianResidual()};
  }

 private:
  double* Theta() { return parameters_.data(); }
  double* Homography(uint32_t view) { return parameters_.data() + 4 + 9 * view; }

  void SetStart() {
    const InverseDistortion& start = options_.start;
    parameters_ = {start.center.x(), start.center.y(), start.k1, start.k2};
    for (const Eigen::Matrix3d& h : tree_->view_from_parent) {
      const RowMatrix3 unit = h / h.norm();
      parameters_.insert(parameters_.end(), unit.data(), unit.data() + 9);
    }
  }

  void AddResiduals() {
    auto* loss = new ceres::CauchyLoss(options_.loss_scale / MeanSigma(views_, *tree_));
    for (const auto& [i, j] : ChoosePairs(views_, *tree_, options_.extra_pairs))
      AddPair(i, j, loss);
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<ThetaPrior, 4, 4>(new ThetaPrior{
                                  options_.center_sigma, options_.coefficient_sigma}),
                              nullptr, Theta());
    for (const uint32_t v : tree_->order) {
      if (v != tree_->root) problem_.SetManifold(Homography(v), new ceres::SphereManifold<9>());
    }
  }

  // The points that views i and j both see.
  void AddPair(uint32_t i, uint32_t j, ceres::LossFunction* loss) {
    const std::vector<Step> path = PathBetween(*tree_, i, j);
    std::vector<double*> parameter_blocks = {Theta()};
    for (const Step& step : path) parameter_blocks.push_back(Homography(step.child));
    for (const auto& [a, b] : CommonPoints(views_[i], views_[j])) {
      const double sigma = std::hypot(views_[i][a].sigma, views_[j][b].sigma);
      auto* cost = new ceres::DynamicAutoDiffCostFunction<TransferCost, 7>(
          new TransferCost(path, views_[i][a].x, views_[j][b].x, sigma));
      cost->AddParameterBlock(4);
      for (size_t s = 0; s < path.size(); ++s) cost->AddParameterBlock(9);
      cost->SetNumResiduals(2);
      residual_blocks_.push_back(problem_.AddResidualBlock(cost, loss, parameter_blocks));
      sigmas_.push_back(sigma);
    }
  }

  double MedianResidual() {
    std::vector<double> lengths;
    for (size_t i = 0; i < residual_blocks_.size(); ++i) {
      double cost = 0;
      std::array<double, 2> residual;
      if (!problem_.EvaluateResidualBlock(residual_blocks_[i], false, &cost, residual.data(),
                                          nullptr))
        continue;
      lengths.push_back(std::hypot(residual[0], residual[1]) * sigmas_[i]);
    }
    return MedianOf(std::move(lengths));
  }

  const std::vector<PlanarView>& views_;
  const DistortionOptions& options_;
  ViewTree* const tree_;
  // Theta, then one homography for each view: in one array, because Ceres orders parameter blocks
  // by their addresses and the result must not depend on where the memory lies.
  std::vector<double> parameters_;
  std::vector<ceres::ResidualBlockId> residual_blocks_;  // of the points; the prior is not in it
  std::vector<double> sigmas_;                           // of each of residual_blocks_
  ceres::Problem problem_;
};

}  // namespace

Status DistortionOptions::Check() const {
  return OptionBounds()
      .Finite("start.center.x", start.center.x())
      .Finite("start.center.y", start.center.y())
      .Finite("start.k1", start.k1)
      .Finite("start.k2", start.k2)
      .FiniteAbove("center_sigma", center_sigma, 0)
      .FiniteAbove("coefficient_sigma", coefficient_sigma, 0)
      .FiniteAbove("loss_scale", loss_scale, 0)
      .status();
}

Result<DistortionEstimate> EstimateDistortion(const std::vector<PlanarView>& views,
                                              const DistortionOptions& options, ViewTree* tree) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  return Estimator(views, options, tree).Run();
}

}  // namespace veduta
