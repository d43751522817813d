// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/known_camera.h"

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/camera/number_text.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr size_t kCoefficientsMax = 12;  // OpenCV's, but for those of tilted sensors
// How far the two models may be apart somewhere in the photo, over the longer side. Chosen by hand.
constexpr double kDifferenceMax = 0.005;
constexpr int kDirections = 64, kSteps = 64;  // of rays from the principal point; chosen by hand

using Coefficients = std::array<double, kCoefficientsMax>;

// OpenCV's model: from normalised undistorted to normalised distorted coordinates.
Eigen::Vector2d Distort(const Coefficients& k, const Eigen::Vector2d& x) {
  const double r2 = x.squaredNorm(), r4 = r2 * r2, r6 = r4 * r2, xy = x.x() * x.y();
  const double radial =
      (1 + k[0] * r2 + k[1] * r4 + k[4] * r6) / (1 + k[5] * r2 + k[6] * r4 + k[7] * r6);
  return {
      x.x() * radial + 2 * k[2] * xy + k[3] * (r2 + 2 * x.x() * x.x()) + k[8] * r2 + k[9] * r4,
      x.y() * radial + k[2] * (r2 + 2 * x.y() * x.y()) + 2 * k[3] * xy + k[10] * r2 + k[11] * r4};
}

struct Ray {
  Eigen::Vector2d x;   // normalised, undistorted
  Eigen::Vector2d px;  // where the known camera sees it
};

// Rays from the principal point outwards, in all directions, until they leave the photo or until
// the known model folds over.
std::vector<Ray> RaysThatReachThePhoto(const KnownCamera& known, const Coefficients& k) {
  const double width = known.size.width_px, height = known.size.height_px;
  const double across = std::hypot(width / known.fx, height / known.fy);
  std::vector<Ray> rays;
  for (int d = 0; d < kDirections; ++d) {
    const double angle = 2 * std::numbers::pi * d / kDirections;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    double last = -1;
    for (int step = 0; step < 4 * kSteps; ++step) {
      const Eigen::Vector2d x = across * step / kSteps * direction, distorted = Distort(k, x);
      const Eigen::Vector2d px(known.cx + known.fx * distorted.x(),
                               known.cy + known.fy * distorted.y());
      const bool is_inside =
          px.x() >= -0.5 && px.y() >= -0.5 && px.x() <= width - 0.5 && px.y() <= height - 0.5;
      if (!px.allFinite() || !is_inside || distorted.dot(direction) <= last) break;
      last = distorted.dot(direction);
      rays.push_back({x, px});
    }
  }
  return rays;
}

// (ours - theirs) in px, over (k1, k2, u0, v0), the centre in normalised coordinates.
struct DifferenceCost {
  Ray ray;
  double fx, fy, cx, cy;
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    const T dx = T(ray.x.x()) - lens[2], dy = T(ray.x.y()) - lens[3];
    const T r2 = dx * dx + dy * dy, factor = T(1) + r2 * (lens[0] + lens[1] * r2);
    residual[0] = T(cx) + T(fx) * (lens[2] + dx * factor) - T(ray.px.x());
    residual[1] = T(cy) + T(fy) * (lens[3] + dy * factor) - T(ray.px.y());
    return true;
  }
};

// Holds the centre of distortion near the principal point where a lens hardly distorts. The weight
// is so small that it changes nothing elsewhere; chosen by hand.
struct CenterCost {
  template <typename T>
  bool operator()(const T* lens, T* residual) const {
    residual[0] = T(1e-3) * lens[2];
    residual[1] = T(1e-3) * lens[3];
    return true;
  }
};

void FitLens(const std::vector<Ray>& rays, CameraModel* model) {
  std::array<double, 4> lens = {model->k1, model->k2, 0, 0};
  ceres::Problem problem;
  for (const Ray& ray : rays) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DifferenceCost, 2, 4>(
            new DifferenceCost{ray, model->fx, model->fy, model->cx, model->cy}),
        nullptr, lens.data());
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CenterCost, 2, 4>(new CenterCost),
                           nullptr, lens.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return;
  model->k1 = lens[0];
  model->k2 = lens[1];
  model->u0 = model->cx + model->fx * lens[2];
  model->v0 = model->cy + model->fy * lens[3];
}

// The rays that our model sees at a grid of the photo's pixels, corners included, and where the
// known camera sees them.
std::vector<Ray> RaysOfGrid(const CameraModel& model, const Coefficients& k,
                            std::vector<Eigen::Vector2d>* ours_px) {
  constexpr int kAcross = 32, kDown = 24;
  const Eigen::Vector2d center(model.cx, model.cy), focal(model.fx, model.fy);
  std::vector<Ray> rays;
  for (int i = 0; i < (kAcross + 1) * (kDown + 1); ++i) {
    const Eigen::Vector2d px(i % (kAcross + 1) * (model.width_px - 1.0) / kAcross,
                             i / (kAcross + 1) * (model.height_px - 1.0) / kDown);
    // The model has passed CheckCamera, so there always is an undistorted pixel.
    const Eigen::Vector2d undistorted = UndistortPixel(model, px).value_or(px);
    const Eigen::Vector2d x = (undistorted - center).cwiseQuotient(focal);
    rays.push_back({x, center + focal.cwiseProduct(Distort(k, x))});
    ours_px->push_back(px);
  }
  return rays;
}

// Fits our model first to rays that certainly reach the photo, then to the rays that our model sees
// at the photo's pixels, its corners included.
Status FitLens(const KnownCamera& known, const Coefficients& k, ConvertedCamera* made) {
  FitLens(RaysThatReachThePhoto(known, k), &made->model);
  std::vector<Eigen::Vector2d> ours_px;
  for (int round = 0; round < 2; ++round) {
    VEDUTA_RETURN_IF_ERROR(CheckCamera(made->model));
    FitLens(RaysOfGrid(made->model, k, &ours_px), &made->model);
  }
  VEDUTA_RETURN_IF_ERROR(CheckCamera(made->model));
  ours_px.clear();
  const std::vector<Ray> rays = RaysOfGrid(made->model, k, &ours_px);
  for (size_t i = 0; i < rays.size(); ++i) {
    const double error_px = (rays[i].px - ours_px[i]).norm();
    made->residual.mean_px += error_px / static_cast<double>(rays.size());
    made->residual.largest_px = std::max(made->residual.largest_px, error_px);
  }
  return Status::Ok();
}

}  // namespace

Result<ConvertedCamera> ConvertCamera(const KnownCamera& known) {
  if (known.coefficients.size() > kCoefficientsMax) {
    return Status::InvalidArgument(
        "camera: " + std::to_string(known.coefficients.size()) +
        " distortion coefficients; at most 12 of OpenCV's are understood");
  }
  Coefficients k{};
  std::copy(known.coefficients.begin(), known.coefficients.end(), k.begin());
  if (!std::all_of(k.begin(), k.end(), [](double c) { return std::isfinite(c); })) {
    return Status::InvalidArgument("camera: a distortion coefficient is not a finite number");
  }
  ConvertedCamera made;
  made.model = {known.size.width_px,
                known.size.height_px,
                known.fx,
                known.fy,
                known.cx,
                known.cy,
                0,
                0,
                known.cx,
                known.cy};
  VEDUTA_RETURN_IF_ERROR(CheckCamera(made.model));
  made.model.k1 = k[0];
  made.model.k2 = k[1];
  const bool is_exact = std::all_of(k.begin() + 2, k.end(), [](double c) { return c == 0; });
  if (!is_exact) {
    VEDUTA_RETURN_IF_ERROR(FitLens(known, k, &made));
    if (!(made.residual.largest_px <=
          kDifferenceMax * std::max(known.size.width_px, known.size.height_px))) {
      return Status::InvalidArgument(
          "camera: its distortion cannot be expressed by k1, k2 and a centre: they would be " +
          NumberText(std::round(10 * made.residual.largest_px) / 10) +
          " px off somewhere in the photo; calibrate it with veduta calibrate");
    }
  }
  VEDUTA_RETURN_IF_ERROR(CheckCamera(made.model));
  return made;
}

}  // namespace veduta
