// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/network_covariance.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "engine/mapping/covisible_images.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// The unknowns of one image: six of its pose, and those of its lens where it is unknown.
constexpr int kLens = kLensUnknowns;
using ByUnknowns = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 6 + kLens>;
using OfUnknowns =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6 + kLens, 6 + kLens>;
using Coupling = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 6 + kLens, 3>;
using Score = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6 + kLens, 1>;

// Reciprocal condition below which the network is not determined: far above the rounding of sums of
// doubles. Chosen by hand; not measured.
constexpr double kReciprocalConditionMin = 1e-13;

// Cells across a picture's width. With 8 of them 31 of 50 true centres were in ellipsoids of 95 %,
// with 4 it was 47 (street --seed 52 of docs/benchmarks.md, localising): errors are still
// correlated in cells that are too small.
constexpr double kCellsAcross = 4;

Eigen::Matrix3d Cross(const Eigen::Vector3d& x) {
  Eigen::Matrix3d matrix;
  matrix << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  return matrix;
}

// A network: its problem, and the lens of image 0 where that is unknown. The unknowns are
// (omega, d) of each pose as in PoseCovariance; those of the lens come after those of pose 0.
struct Network {
  const BundleProblem& problem;
  const CameraModel* lens = nullptr;

  Eigen::Index lens_size() const { return lens == nullptr ? 0 : kLens; }
  Eigen::Index pose_count() const {
    return static_cast<Eigen::Index>(problem.cams_from_world.size());
  }
  Eigen::Index size() const { return 6 * pose_count() + lens_size(); }
  Eigen::Index Row(Eigen::Index image) const { return image == 0 ? 0 : 6 * image + lens_size(); }
  Eigen::Index RowCount(Eigen::Index image) const { return image == 0 ? 6 + lens_size() : 6; }
};

// The derivative of an undistorted pixel's error by the lens (kLensUnknowns): that of the place in
// the photo, carried back through the distortion. u is the point in image coordinates at depth 1.
Eigen::Matrix<double, 2, kLens> ByLens(const CameraModel& lens, const Eigen::Vector2d& u) {
  const double r2 = u.squaredNorm(), stretch = 1 + lens.k1 * r2 + lens.k2 * r2 * r2;
  const Eigen::Matrix2d distortion =
      stretch * Eigen::Matrix2d::Identity() + (2 * lens.k1 + 4 * lens.k2 * r2) * u * u.transpose();
  Eigen::Matrix<double, 2, kLens> by_lens;
  by_lens << stretch * u, r2 * u, r2 * r2 * u, Eigen::Matrix2d::Identity();
  return lens.fx * distortion.inverse() * by_lens;
}

// A part of one image's picture: the image's place in the problem, and a column and a row.
using Cell = std::array<int64_t, 3>;

Cell CellOf(const BundleProblem& problem, const BundleObservation& seen) {
  // The principal point is near the middle, so half of its x is a quarter of the picture.
  const double side_px = std::max(1.0, problem.cameras[seen.image].cx * 2 / kCellsAcross);
  return {int64_t{seen.image}, static_cast<int64_t>(std::floor(seen.x_px.x() / side_px)),
          static_cast<int64_t>(std::floor(seen.x_px.y() / side_px))};
}

// The sums over all points: the information of all unknowns, with the points eliminated, and what
// each cell adds to the derivative of the cost by them.
struct Sums {
  explicit Sums(Eigen::Index size) : information(Eigen::MatrixXd::Zero(size, size)) {}

  Eigen::MatrixXd information;
  std::map<Cell, Eigen::VectorXd> scores;
  double squares = 0, curvature = 0;
  size_t observations = 0, points = 0;
};

// What one image sees of a point: w^2 J'J of the image's unknowns, and of these and the point;
// w J'e of both.
struct Seen {
  Cell cell;
  Eigen::Index row = 0;
  OfUnknowns own;
  Coupling coupling;
  Score score;
  Eigen::Vector3d point_score;
};

Seen Look(const Network& network, uint32_t point, const BundleObservation& observation,
          double weight, const Eigen::Vector2d& error, const Matrix23d& by_cam) {
  const Rigid3& cam_from_world = network.problem.cams_from_world[observation.image];
  const Eigen::Vector3d x_cam = cam_from_world * network.problem.points[point];
  const Eigen::Matrix<double, 2, 3> by_point = by_cam * cam_from_world.rotation.toRotationMatrix();
  ByUnknowns by_own(2, network.RowCount(observation.image));
  // x_cam = R (X - c) changes by omega x x_cam - R d
  by_own.leftCols<3>() = -by_cam * Cross(x_cam);
  by_own.middleCols<3>(3) = -by_point;
  if (by_own.cols() > 6) by_own.rightCols<kLens>() = ByLens(*network.lens, x_cam.hnormalized());
  const double squared = weight * weight;
  return {CellOf(network.problem, observation),  network.Row(observation.image),
          squared * by_own.transpose() * by_own, squared * by_own.transpose() * by_point,
          weight * by_own.transpose() * error,   weight * by_point.transpose() * error};
}

// Adds what is seen of a point whose information by itself has this inverse.
void Eliminate(const std::vector<Seen>& seen, const Eigen::Matrix3d& inverse, Sums* sums) {
  // The point takes three of the numbers observed, and the errors are so much smaller for that.
  const double observed = 2 * static_cast<double>(seen.size());
  const double leave_out = observed / (observed - 3);
  for (const Seen& a : seen) {
    Eigen::VectorXd& score =
        sums->scores.try_emplace(a.cell, Eigen::VectorXd::Zero(sums->information.rows()))
            .first->second;
    score.segment(a.row, a.score.size()) += leave_out * a.score;
    const Eigen::Vector3d by_point = leave_out * inverse * a.point_score;
    const Coupling by_inverse = a.coupling * inverse;
    sums->information.block(a.row, a.row, a.own.rows(), a.own.cols()) += a.own;
    for (const Seen& b : seen) {
      score.segment(b.row, b.coupling.rows()).noalias() -= b.coupling * by_point;
      sums->information.block(a.row, b.row, a.coupling.rows(), b.coupling.rows()).noalias() -=
          by_inverse * b.coupling.transpose();
    }
  }
}

// Adds point `index`, unless what is seen of it does not determine it.
void AddPoint(const Network& network, uint32_t index, double loss_scale_px, Sums* sums) {
  const BundleProblem& problem = network.problem;
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
  std::vector<Seen> seen;
  double squares = 0, curvature = 0;
  for (uint32_t o = problem.first_observation[index]; o < problem.first_observation[index + 1];
       ++o) {
    const BundleObservation& observation = problem.observations[o];
    const Rigid3& cam_from_world = problem.cams_from_world[observation.image];
    Matrix23d by_cam;
    const Eigen::Vector2d error =
        ReprojectionError(problem.cameras[observation.image],
                          cam_from_world * problem.points[index], observation.x_px, &by_cam);
    if (by_cam.isZero(0)) continue;  // behind the camera
    const double square = error.squaredNorm();
    const double weight = 1 / (1 + square / (loss_scale_px * loss_scale_px));
    const Eigen::Matrix<double, 2, 3> by_point =
        by_cam * cam_from_world.rotation.toRotationMatrix();
    squares += weight * weight * square;
    curvature += weight * weight;
    own.noalias() += weight * weight * by_point.transpose() * by_point;
    seen.push_back(Look(network, index, observation, weight, error, by_cam));
  }
  Eigen::Matrix3d inverse;
  bool is_invertible = false;
  own.computeInverseWithCheck(inverse, is_invertible, 0);
  if (seen.size() < 2 || !is_invertible || !inverse.allFinite()) return;
  Eliminate(seen, inverse, sums);
  sums->squares += squares;
  sums->curvature += curvature;
  sums->observations += seen.size();
  ++sums->points;
}

// How the poses change where all of the world is moved, turned or scaled a little: 7 columns.
Eigen::MatrixXd Gauge(const Network& network) {
  const BundleProblem& problem = network.problem;
  Eigen::MatrixXd gauge = Eigen::MatrixXd::Zero(network.size(), 7);
  const Eigen::Vector3d origin = problem.cams_from_world[0].Center();
  for (Eigen::Index i = 0; i < network.pose_count(); ++i) {
    const Rigid3& cam_from_world = problem.cams_from_world[static_cast<size_t>(i)];
    const Eigen::Vector3d center = cam_from_world.Center() - origin;
    const Eigen::Index row = network.Row(i);
    gauge.block<3, 3>(row + 3, 0).setIdentity();
    gauge.block<3, 3>(row, 3) = -cam_from_world.rotation.toRotationMatrix();
    gauge.block<3, 3>(row + 3, 3) = -Cross(center);
    gauge.block<3, 1>(row + 3, 6) = center;
  }
  return gauge;
}

double MedianDepth(const BundleProblem& problem) {
  std::vector<double> depths;
  for (const Eigen::Vector3d& point : problem.points) {
    const double depth = (problem.cams_from_world[0] * point).z();
    if (depth > 0) depths.push_back(depth);
  }
  return MedianOf(std::move(depths), 1.0);
}

// H^- of the information, as far as it concerns image 0: of the inverses that differ by the frame,
// the one of the frame of the other poses. [unknowns of image 0 x size].
std::optional<Eigen::MatrixXd> InverseInFrame(const Network& network,
                                              const Eigen::MatrixXd& information) {
  const Eigen::Index size = information.rows(), own = network.RowCount(0);
  // Lengths in depths: all unknowns are angles then.
  const double depth = MedianDepth(network.problem);
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(size);
  for (Eigen::Index i = 0; i < network.pose_count(); ++i)
    unit.segment<3>(network.Row(i) + 3).setConstant(depth);
  const Eigen::MatrixXd scaled = unit.asDiagonal() * information * unit.asDiagonal();
  Eigen::MatrixXd gauge = unit.cwiseInverse().asDiagonal() * Gauge(network);
  for (Eigen::Index column = 0; column < 7; ++column) gauge.col(column).normalize();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(gauge);
  const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(size, 7);
  // The directions of the frame get some information, which the transformation takes out again.
  const double some = scaled.trace() / static_cast<double>(size);
  const Eigen::LDLT<Eigen::MatrixXd> solver(scaled + some * basis * basis.transpose());
  if (solver.info() != Eigen::Success || !(solver.rcond() > kReciprocalConditionMin))
    return std::nullopt;
  Eigen::MatrixXd of_others = basis;
  of_others.topRows(own).setZero();
  const Eigen::FullPivLU<Eigen::Matrix<double, 7, 7>> lu(of_others.transpose() * basis);
  if (!lu.isInvertible()) return std::nullopt;
  // The rows of the S-transformation that belong to image 0.
  Eigen::MatrixXd rows = -basis.topRows(own) * lu.solve(of_others.transpose());
  rows.leftCols(own) += Eigen::MatrixXd::Identity(own, own);
  const Eigen::MatrixXd inverse = solver.solve(rows.transpose()).transpose();
  return unit.head(own).asDiagonal() * inverse * unit.asDiagonal();
}

// The covariance of image 0's unknowns, and the error that it rests on.
struct OwnCovariance {
  Eigen::MatrixXd covariance;
  double error_px = 0;
};

std::optional<OwnCovariance> CovarianceOfFirst(const Network& network, double loss_scale_px) {
  const BundleProblem& problem = network.problem;
  if (problem.cams_from_world.size() < 3) return std::nullopt;
  Sums sums(network.size());
  for (uint32_t i = 0; i < problem.points.size(); ++i) AddPoint(network, i, loss_scale_px, &sums);
  const double observed = 2 * static_cast<double>(sums.observations);
  const double taken = static_cast<double>(network.size()) - 7;
  const double redundancy = observed - taken - 3 * static_cast<double>(sums.points);
  if (!(redundancy > 0) || !(sums.curvature > 0)) return std::nullopt;
  Eigen::VectorXd prior;  // what k1, k2 and the centre are drawn to 0 by
  if (network.lens != nullptr) prior = LensDeviations(*network.lens).cwiseInverse();
  sums.information.diagonal().segment(7, prior.size()) += prior.cwiseAbs2();
  const std::optional<Eigen::MatrixXd> inverse = InverseInFrame(network, sums.information);
  if (!inverse) return std::nullopt;
  OwnCovariance result;
  result.covariance = Eigen::MatrixXd::Zero(inverse->rows(), inverse->rows());
  for (Eigen::Index k = 0; k < prior.size(); ++k) {
    const Eigen::VectorXd moved = prior(k) * inverse->col(7 + k);
    result.covariance += moved * moved.transpose();
  }
  for (const auto& [cell, score] : sums.scores) {
    const Eigen::VectorXd moved = *inverse * score;
    result.covariance += moved * moved.transpose();
  }
  // The unknowns take some of what the cells tell, two numbers each, and the scores are smaller by
  // it.
  const double told = 2 * static_cast<double>(sums.scores.size());
  if (told <= taken) return std::nullopt;
  result.covariance *= std::pow(told / (told - taken), 2);
  if (!result.covariance.allFinite() || !(result.covariance.diagonal().minCoeff() > 0))
    return std::nullopt;
  result.error_px = std::sqrt(sums.squares / redundancy) * observed / (2 * sums.curvature);
  return result;
}

}  // namespace

BundleProblem NetworkProblem(const CityMap& map, ImageId view, uint32_t neighbors_max) {
  std::vector<ImageId> images = CovisibleImages(map, view, neighbors_max);
  images.insert(images.begin(), view);
  BundleProblem problem;
  problem.free_count = static_cast<uint32_t>(images.size());
  std::map<ImageId, uint32_t> places;
  for (const ImageId id : images) {
    places.emplace(id, static_cast<uint32_t>(problem.cams_from_world.size()));
    problem.cams_from_world.push_back(map.image(id).cam_from_world);
    problem.cameras.push_back(map.image(id).camera);
  }
  for (const PointId id : map.PointsSeenBy(images)) {
    const PointRecord& point = map.point(id);
    std::vector<BundleObservation> seen;
    for (const TrackElement& element : point.track) {
      const auto place = places.find(element.image);
      if (place == places.end()) continue;
      const Keypoint& keypoint = map.image(element.image).features->keypoints[element.feature];
      seen.push_back({place->second, {keypoint.x_px, keypoint.y_px}});
    }
    if (seen.size() < 2) continue;
    problem.points.push_back(point.position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    problem.observations.insert(problem.observations.end(), seen.begin(), seen.end());
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

std::optional<PoseCovariance> CovarianceInNetwork(const BundleProblem& problem,
                                                  double loss_scale_px) {
  const std::optional<OwnCovariance> own = CovarianceOfFirst({problem}, loss_scale_px);
  if (!own) return std::nullopt;
  return PoseCovariance{own->covariance, own->error_px};
}

std::optional<CameraCovariance> CovarianceWithLens(const BundleProblem& problem,
                                                   const CameraModel& lens, double loss_scale_px) {
  const std::optional<OwnCovariance> own = CovarianceOfFirst({problem, &lens}, loss_scale_px);
  if (!own) return std::nullopt;
  return CameraCovariance{{own->covariance.topLeftCorner<6, 6>(), own->error_px},
                          own->covariance.bottomRightCorner<kLens, kLens>()};
}

}  // namespace veduta
