// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/unknown_camera.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>

#include "engine/camera/projection.h"
#include "engine/matching/sampling.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr int kUnknowns = 6 + kLensUnknowns;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// Distortions that are tried with each focal length. Chosen by hand; not measured.
constexpr double kDistortions[] = {0, -0.12, 0.06};
// The search finds a neighbourhood and no more: an error of 1 % of the longer side is allowed. The
// refinement begins with twice that, and allows half as much in each round. Chosen by hand; not
// measured.
constexpr double kSearchErrorShare = 0.01;
constexpr int kRefineSteps = 30;
// Of the logarithm of a focal length that is told. Chosen by hand; the header says what it stands
// for.
constexpr double kToldDeviation = 0.04;

CameraModel CameraOf(uint32_t width_px, uint32_t height_px, double focal_px, double k1) {
  CameraModel camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.fx = camera.fy = focal_px;
  camera.cx = camera.u0 = 0.5 * (width_px - 1);
  camera.cy = camera.v0 = 0.5 * (height_px - 1);
  camera.k1 = k1;
  return camera;
}

// Whether a ray lies before the first place where the distortion folds over: the smallest root of
// its slope, 1 + 3 k1 r^2 + 5 k2 r^4.
bool IsBeforeFold(const CameraModel& camera, double r2) {
  const double k1 = camera.k1, k2 = camera.k2;
  if (!(1 + 3 * k1 * r2 + 5 * k2 * r2 * r2 > 0)) return false;
  const double discriminant = 9 * k1 * k1 - 20 * k2;
  if (k1 >= 0 || k2 <= 0 || discriminant <= 0) return true;  // the slope has one root at most
  return r2 < (-3 * k1 - std::sqrt(discriminant)) / (10 * k2);
}

// Where a point is seen, from the photo's middle, with the derivatives that are asked for.
struct Projection {
  bool is_before = false;  // the camera, and within where the distortion does not fold over
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, kUnknowns> derivative;
};

Projection Project(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                   const CameraModel& camera, const Eigen::Vector3d& point) {
  Projection seen;
  const Eigen::Vector3d rotated = rotation * point, p = rotated + translation;
  if (!(p.z() > 1e-9)) return seen;
  const Eigen::Vector2d u = p.hnormalized();
  const double r2 = u.squaredNorm(), k1 = camera.k1, k2 = camera.k2, focal = camera.fx;
  if (!IsBeforeFold(camera, r2)) return seen;
  seen.is_before = true;
  const double stretch = 1 + k1 * r2 + k2 * r2 * r2;
  seen.x_px = focal * stretch * u;
  const Eigen::Matrix2d by_u =
      focal * (stretch * Eigen::Matrix2d::Identity() + (2 * k1 + 4 * k2 * r2) * u * u.transpose());
  Eigen::Matrix<double, 2, 3> u_by_p;
  u_by_p << 1 / p.z(), 0, -u.x() / p.z(), 0, 1 / p.z(), -u.y() / p.z();
  Eigen::Matrix<double, 3, 6> motion;  // rotation about the camera's axes, then translation
  motion << 0, rotated.z(), -rotated.y(), 1, 0, 0, -rotated.z(), 0, rotated.x(), 0, 1, 0,
      rotated.y(), -rotated.x(), 0, 0, 0, 1;
  seen.derivative.leftCols<6>() = by_u * u_by_p * motion;
  seen.derivative.col(6) = seen.x_px;
  seen.derivative.col(7) = focal * r2 * u;
  seen.derivative.col(8) = focal * r2 * r2 * u;
  seen.derivative.rightCols<2>() = focal * Eigen::Matrix2d::Identity();
  return seen;
}

// A pose with its lens, while it is refined.
class LensFit {
 public:
  LensFit(std::span<const Eigen::Vector2d> x_px, std::span<const Eigen::Vector3d> points,
          double scale_px, double told_focal_px)
      : x_px_(x_px), points_(points), scale_(scale_px), told_focal_px_(told_focal_px) {}

  double Cost(const Rigid3& pose, const CameraModel& camera) const {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    const Eigen::Vector2d middle(camera.cx, camera.cy);
    double cost = PriorOf(camera).cwiseProduct(LensDeviations(camera).cwiseInverse()).squaredNorm();
    if (told_focal_px_ > 0) cost += std::pow(ToldErrorOf(camera) / kToldDeviation, 2);
    for (size_t i = 0; i < x_px_.size(); ++i) {
      const Projection seen = Project(rotation, pose.translation, camera, points_[i]);
      const double square = seen.is_before ? (seen.x_px + middle - x_px_[i]).squaredNorm() : 1e8;
      cost += scale_ * scale_ * std::log1p(square / (scale_ * scale_));
    }
    return cost;
  }

  // The normal equations, and the squares of the weighted errors with how curved the loss is there.
  struct Equations {
    Normal normal = Normal::Zero();
    Unknowns gradient = Unknowns::Zero();
    double squares = 0, curvature = 0;
    size_t observations = 0;
  };
  Equations Linearize(const Rigid3& pose, const CameraModel& camera) const {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    const Eigen::Vector2d middle(camera.cx, camera.cy);
    Equations sum;
    for (size_t i = 0; i < x_px_.size(); ++i) {
      const Projection seen = Project(rotation, pose.translation, camera, points_[i]);
      if (!seen.is_before) continue;
      const Eigen::Vector2d error = seen.x_px + middle - x_px_[i];
      const double weight = 1 / (1 + error.squaredNorm() / (scale_ * scale_));
      sum.normal.noalias() += weight * seen.derivative.transpose() * seen.derivative;
      sum.gradient.noalias() += weight * seen.derivative.transpose() * error;
      sum.squares += weight * error.squaredNorm();
      sum.curvature += weight;
      ++sum.observations;
    }
    const Eigen::Vector4d weights = LensDeviations(camera).cwiseAbs2().cwiseInverse();
    sum.normal.diagonal().tail<4>() += weights;
    sum.gradient.tail<4>() += weights.cwiseProduct(PriorOf(camera));
    if (told_focal_px_ > 0) {
      constexpr double kWeight = 1 / (kToldDeviation * kToldDeviation);
      sum.normal(6, 6) += kWeight;
      sum.gradient(6) += kWeight * ToldErrorOf(camera);
    }
    return sum;
  }

  static void Move(const Unknowns& step, Rigid3* pose, CameraModel* camera) {
    const Eigen::Vector3d omega = step.head<3>();
    if (omega.norm() > 0) {
      pose->rotation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm(), omega.normalized())) * pose->rotation)
              .normalized();
    }
    pose->translation += step.segment<3>(3);
    camera->fx = camera->fy = camera->fx * std::exp(std::clamp(step(6), -0.5, 0.5));
    camera->k1 += step(7);
    camera->k2 += step(8);
    camera->u0 = camera->cx += camera->fx * step(9);
    camera->v0 = camera->cy += camera->fx * step(10);
  }

 private:
  // What is drawn to 0: k1, k2 and how far the principal point is from the middle.
  static Eigen::Vector4d PriorOf(const CameraModel& camera) {
    return {camera.k1, camera.k2, (camera.cx - 0.5 * (camera.width_px - 1)) / camera.fx,
            (camera.cy - 0.5 * (camera.height_px - 1)) / camera.fx};
  }

  double ToldErrorOf(const CameraModel& camera) const {
    return std::log(camera.fx / told_focal_px_);
  }

  const std::span<const Eigen::Vector2d> x_px_;
  const std::span<const Eigen::Vector3d> points_;
  const double scale_, told_focal_px_;
};

std::vector<uint32_t> FindInliers(const Rigid3& pose, const CameraModel& camera,
                                  std::span<const Eigen::Vector2d> x_px,
                                  std::span<const Eigen::Vector3d> points, double error_px_max) {
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  const Eigen::Vector2d middle(camera.cx, camera.cy);
  std::vector<uint32_t> inliers;
  for (uint32_t i = 0; i < x_px.size(); ++i) {
    const Projection seen = Project(rotation, pose.translation, camera, points[i]);
    if (seen.is_before && (seen.x_px + middle - x_px[i]).norm() <= error_px_max)
      inliers.push_back(i);
  }
  return inliers;
}

// One focal length with one distortion, and the rays that the features have by it.
struct Trial {
  CameraModel camera;
  std::vector<Eigen::Vector2d> x;  // normalised
  opengv::bearingVectors_t rays;
};

// Each of the focal lengths, over the longer side, with each distortion.
std::vector<Trial> ListTrials(std::span<const Eigen::Vector2d> x_px, uint32_t width_px,
                              uint32_t height_px, std::span<const double> focal_shares) {
  const double side = std::max(width_px, height_px);
  std::vector<Trial> trials;
  for (const double share : focal_shares) {
    for (const double k1 : kDistortions) {
      Trial trial{CameraOf(width_px, height_px, side * share, k1), {}, {}};
      for (const Eigen::Vector2d& px : x_px) {
        const std::optional<Eigen::Vector2d> straight = UndistortPixel(trial.camera, px);
        if (!straight) break;  // it folds over within the photo
        trial.x.push_back(NormalizedFromPixel(trial.camera, *straight));
        trial.rays.push_back(trial.x.back().homogeneous().normalized());
      }
      if (trial.x.size() == x_px.size()) trials.push_back(std::move(trial));
    }
  }
  return trials;
}

std::vector<double> AllFocalShares(const UnknownCameraOptions& options) {
  const double step =
      std::pow(options.focal_share_max / options.focal_share_min, 1.0 / (options.focal_count - 1));
  std::vector<double> shares;
  double share = options.focal_share_min;
  for (uint32_t i = 0; i < options.focal_count; ++i, share *= step) shares.push_back(share);
  return shares;
}

struct Guess {
  Rigid3 pose;
  CameraModel camera;
  uint32_t inliers = 0;
};

uint32_t CountInliers(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                      const Trial& trial, std::span<const Eigen::Vector3d> points, double error_max,
                      uint32_t more_than) {
  const uint32_t n = static_cast<uint32_t>(points.size());
  const double square_max = error_max * error_max;
  uint32_t inliers = 0;
  for (uint32_t i = 0; i < n && inliers + (n - i) > more_than; ++i) {
    const Eigen::Vector3d p = rotation * points[i] + translation;
    inliers +=
        p.z() > 0 && (p.head<2>() - p.z() * trial.x[i]).squaredNorm() < square_max * p.z() * p.z();
  }
  return inliers;
}

// The best guess of each trial, those with most inliers first.
std::vector<Guess> Search(const std::vector<Trial>& trials, std::span<const Eigen::Vector3d> points,
                          uint64_t seed, const ResectionOptions& options) {
  const uint32_t n = static_cast<uint32_t>(points.size());
  const opengv::points_t world(points.begin(), points.end());
  std::vector<Guess> guesses(trials.size());
  SeededRandom random(seed);
  std::vector<int> sample(3);
  uint32_t needed = options.samples_max, best = 0;
  for (uint32_t t = 0; t < needed; ++t) {
    DrawDistinct(random, FrontCount(n, t, 20), sample);
    for (size_t k = 0; k < trials.size(); ++k) {
      const Trial& trial = trials[k];
      const double error_max = kSearchErrorShare *
                               std::max(trial.camera.width_px, trial.camera.height_px) /
                               trial.camera.fx;
      const opengv::absolute_pose::CentralAbsoluteAdapter adapter(trial.rays, world);
      for (const opengv::transformation_t& world_from_cam :
           opengv::absolute_pose::p3p_kneip(adapter, sample)) {
        if (!world_from_cam.allFinite()) continue;
        const Eigen::Matrix3d rotation = world_from_cam.leftCols<3>().transpose();
        const Eigen::Vector3d translation = -rotation * world_from_cam.col(3);
        const uint32_t inliers =
            CountInliers(rotation, translation, trial, points, error_max, guesses[k].inliers);
        if (inliers <= guesses[k].inliers) continue;
        guesses[k] = {
            {Eigen::Quaterniond(rotation).normalized(), translation}, trial.camera, inliers};
        best = std::max(best, inliers);
      }
    }
    needed = std::min(options.samples_max,
                      std::max(20u, SamplesNeeded(options.confidence, best / double(n), 3)));
  }
  std::ranges::stable_sort(guesses, std::greater<>(), &Guess::inliers);
  return guesses;
}

// Guesses that are refined, at most; neighbouring focal lengths explain nearly the same. Chosen by
// hand; not measured.
constexpr size_t kGuessesMax = 5;
// Of the focal lengths around the one that a photo tells, which is rounded and mostly counted along
// the diagonal: 12 % to both sides. Chosen by hand.
constexpr double kToldStep = 1.08;

bool IsEnough(const UnknownCameraResection& found, size_t count, const ResectionOptions& options) {
  const size_t inliers = found.inliers.size();
  return inliers >= options.inlier_count_min &&
         static_cast<double>(inliers) >= options.inlier_share_min * static_cast<double>(count);
}

// By these focal lengths, over the longer side.
UnknownCameraResection ResectWith(std::span<const double> focal_shares,
                                  std::span<const Eigen::Vector2d> x_px,
                                  std::span<const Eigen::Vector3d> points, uint32_t width_px,
                                  uint32_t height_px, uint64_t seed,
                                  const ResectionOptions& options) {
  UnknownCameraResection best;
  if (x_px.size() != points.size() || x_px.size() < options.inlier_count_min) return best;
  best.outcome = ResectionOutcome::kTooFewInliers;
  const double search_error_px = kSearchErrorShare * std::max(width_px, height_px);
  const std::vector<Guess> guesses =
      Search(ListTrials(x_px, width_px, height_px, focal_shares), points, seed, options);
  for (size_t i = 0; i < std::min(kGuessesMax, guesses.size()); ++i) {
    if (guesses[i].inliers < options.inlier_count_min / 2) break;
    Rigid3 pose = guesses[i].pose;
    CameraModel camera = guesses[i].camera;
    double error_px = 2 * search_error_px;
    while (true) {
      std::vector<Eigen::Vector2d> in_x;
      std::vector<Eigen::Vector3d> in_points;
      for (const uint32_t k : FindInliers(pose, camera, x_px, points, error_px)) {
        in_x.push_back(x_px[k]);
        in_points.push_back(points[k]);
      }
      if (in_x.size() < 6) break;
      const RefinedCamera refined =
          RefineUnknownCamera(pose, camera, in_x, in_points, 0.3 * error_px);
      pose = refined.cam_from_world, camera = refined.camera;
      if (error_px <= options.error_px_max) break;
      error_px = std::max(options.error_px_max, 0.5 * error_px);
    }
    std::vector<uint32_t> inliers = FindInliers(pose, camera, x_px, points, options.error_px_max);
    if (inliers.size() <= best.inliers.size()) continue;
    best.cam_from_world = pose, best.camera = camera, best.inliers = std::move(inliers);
  }
  const bool is_enough = IsEnough(best, x_px.size(), options) && CheckCamera(best.camera).ok();
  best.outcome = is_enough ? ResectionOutcome::kPlaced : ResectionOutcome::kTooFewInliers;
  return best;
}

}  // namespace

Eigen::Vector4d LensDeviations(const CameraModel& camera) {
  // Chosen by hand; not measured. The header says what they stand for.
  constexpr double kDeviationK1 = 0.15, kDeviationK2 = 0.1, kCenterShare = 0.007;
  const double center = kCenterShare * std::max(camera.width_px, camera.height_px) / camera.fx;
  return {kDeviationK1, kDeviationK2, center, center};
}

Status UnknownCameraOptions::Check() const {
  return OptionBounds()
      .Part("resection", resection.Check())
      .Above("focal_share_min", focal_share_min, 0)
      .Above("focal_share_max", focal_share_max, focal_share_min)
      .AtLeast("focal_count", focal_count, 2)
      .AtLeast("told_focal_share", told_focal_share, 0)
      .Part("told", told.Check())
      .status();
}

RefinedCamera RefineUnknownCamera(const Rigid3& start, const CameraModel& camera,
                                  std::span<const Eigen::Vector2d> x_px,
                                  std::span<const Eigen::Vector3d> points, double scale_px,
                                  double told_focal_px) {
  const LensFit fit(x_px, points, scale_px, told_focal_px);
  RefinedCamera refined{start, camera, Normal::Zero()};
  double cost = fit.Cost(start, camera), damping = 1e-4;
  for (int i = 0; i < kRefineSteps && damping < 1e8; ++i) {
    const LensFit::Equations sum = fit.Linearize(refined.cam_from_world, refined.camera);
    Normal damped = sum.normal;
    damped.diagonal() *= 1 + damping;
    const Unknowns step = -damped.ldlt().solve(sum.gradient);
    Rigid3 pose = refined.cam_from_world;
    CameraModel lens = refined.camera;
    if (step.allFinite()) LensFit::Move(step, &pose, &lens);
    const double next = step.allFinite() ? fit.Cost(pose, lens) : cost;
    if (!(next < cost)) {
      damping *= 10;
      continue;
    }
    refined.cam_from_world = pose, refined.camera = lens;
    const bool is_done = cost - next <= 1e-9 * cost;
    cost = next, damping *= 0.1;
    if (is_done) break;
  }
  const LensFit::Equations sum = fit.Linearize(refined.cam_from_world, refined.camera);
  const double redundancy = 2 * sum.curvature - kUnknowns;
  const Eigen::LDLT<Eigen::MatrixXd> solver(sum.normal);
  if (redundancy > 0 && solver.info() == Eigen::Success && solver.rcond() > 1e-15) {
    refined.covariance =
        sum.squares / redundancy * solver.solve(Eigen::MatrixXd(Normal::Identity()));
  } else {
    refined.covariance.diagonal().setConstant(std::numeric_limits<double>::infinity());
  }
  return refined;
}

UnknownCameraResection ResectUnknownCamera(std::span<const Eigen::Vector2d> x_px,
                                           std::span<const Eigen::Vector3d> points,
                                           uint32_t width_px, uint32_t height_px, uint64_t seed,
                                           const UnknownCameraOptions& options) {
  UnknownCameraResection by_told;
  if (const double told = options.told_focal_share; told > 0) {
    const double around[] = {told, told / kToldStep, told * kToldStep};
    by_told = ResectWith(around, x_px, points, width_px, height_px, seed, options.told);
    if (by_told.outcome == ResectionOutcome::kPlaced &&
        IsEnough(by_told, x_px.size(), options.resection))
      return by_told;
  }
  UnknownCameraResection by_any = ResectWith(AllFocalShares(options), x_px, points, width_px,
                                             height_px, seed, options.resection);
  const bool is_told_better = by_told.outcome == ResectionOutcome::kPlaced &&
                              (by_any.outcome != ResectionOutcome::kPlaced ||
                               by_told.inliers.size() >= by_any.inliers.size());
  return is_told_better ? by_told : by_any;
}

}  // namespace veduta
