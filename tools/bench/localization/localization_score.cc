// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/localization/localization_score.h"

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>

#include "engine/mapping/similarity.h"
#include "storage/base/angle.h"
#include "storage/base/median.h"

namespace veduta::localization {
namespace {

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// truth_from_world by these poses of one reconstruction.
std::optional<Sim3> Fit(const Poses& poses, uint32_t reconstruction, const orders::Truth& truth) {
  std::vector<Rigid3> found, real;
  for (const auto& [name, pose] : poses) {
    const auto known = truth.find(name);
    if (pose.reconstruction != reconstruction || known == truth.end()) continue;
    found.push_back(pose.cam_from_world);
    real.push_back(known->second);
  }
  return found.size() < 3 ? std::nullopt : FitCameras(found, real);
}

// The poses without one photo's.
Poses Without(Poses poses, const std::string& name) {
  poses.erase(name);
  return poses;
}

// The poses of the images that a localised one rests on.
Poses SupportIn(const Poses& poses, const LocalizedPhoto& photo) {
  Poses support;
  for (const SupportAnswer& image : photo.support) {
    if (const auto found = poses.find(image.name); found != poses.end()) support.insert(*found);
  }
  return support;
}

PoseError ErrorOf(const Rigid3& pose, const Rigid3& real, const Sim3& fit) {
  const Rigid3 fitted = TransformCameraWorld(fit, pose);
  return {(fitted.Center() - real.Center()).norm(),
          fitted.rotation.angularDistance(real.rotation) / kRadPerDeg};
}

// (omega, d) of PoseUncertainty, by which the pose is off.
Eigen::Matrix<double, 6, 1> DeviationOf(const Rigid3& pose, const Rigid3& real, const Sim3& fit) {
  const Rigid3 right = TransformCameraWorld(fit.Inverse(), real);
  const Eigen::AngleAxisd turn(right.rotation * pose.rotation.conjugate());
  Eigen::Matrix<double, 6, 1> deviation;
  deviation << turn.angle() * turn.axis(), right.Center() - pose.Center();
  return deviation;
}

void ScoreCovariance(const PoseUncertainty& uncertainty, const Eigen::Matrix<double, 6, 1>& off,
                     PhotoScore* score) {
  Eigen::Matrix<double, 6, 6> covariance;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column)
      covariance(row, column) =
          uncertainty.covariance[static_cast<size_t>(row)][static_cast<size_t>(column)];
  }
  const Eigen::Matrix3d of_center = covariance.bottomRightCorner<3, 3>();
  score->center_squares = off.tail<3>().dot(of_center.ldlt().solve(off.tail<3>()));
  score->pose_squares = off.dot(covariance.ldlt().solve(off));
}

void ScoreLocalized(const LocalizedPhoto& photo, const Rigid3& real, const LocalizationRun& run,
                    const orders::Truth& truth, PhotoScore* score) {
  if (photo.camera) {
    score->focal_error_share = photo.camera->model.fx / run.focal_px - 1;
    score->focal_deviations = *score->focal_error_share / photo.camera->focal_stddev_share;
  }
  const Pose pose = ToPose(photo.reconstruction, *photo.cam_from_world);
  if (const auto fit = Fit(run.before, pose.reconstruction, truth))
    score->error = ErrorOf(pose.cam_from_world, real, *fit);
  const auto fit = Fit(SupportIn(run.before, photo), pose.reconstruction, truth);
  if (!fit) return;
  score->nearby = ErrorOf(pose.cam_from_world, real, *fit);
  if (photo.uncertainty)
    ScoreCovariance(*photo.uncertainty, DeviationOf(pose.cam_from_world, real, *fit), score);
}

std::string ErrorText(const std::optional<PoseError>& error) {
  return error ? Format("%.4f m %.4f degrees", error->center_m, error->rotation_deg) : "-";
}

// Median, 90th percentile and largest.
std::string Spread(std::vector<double> values) {
  if (values.empty()) return "-";
  const double median = QuantileInPlace(values, 0.5), p90 = QuantileInPlace(values, 0.9);
  return Format("median %.4f, 90 %% below %.4f, largest %.4f", median, p90,
                QuantileInPlace(values, 1.0));
}

std::string Inside(const std::vector<double>& squares, double limit) {
  size_t inside = 0;
  for (const double value : squares) inside += value <= limit ? 1 : 0;
  return Format("%zu of %zu", inside, squares.size());
}

}  // namespace

std::vector<PhotoScore> ScoreLocalization(const LocalizationRun& run, const orders::Truth& truth) {
  std::vector<PhotoScore> scores;
  for (const LocalizedPhoto& photo : run.asked) {
    PhotoScore& score = scores.emplace_back();
    score.name = photo.name;
    score.ms = photo.times.total_ms;
    score.verdict = photo.cam_from_world ? "localized"
                    : photo.failure.ok() ? ReasonSentence(photo.reason, photo.detail)
                                         : photo.failure.message();
    const auto real = truth.find(photo.name);
    if (real == truth.end()) continue;
    if (photo.cam_from_world) ScoreLocalized(photo, real->second, run, truth, &score);
    const auto adjusted = run.after.find(photo.name);
    if (adjusted == run.after.end()) continue;
    const auto fit = Fit(Without(run.after, photo.name), adjusted->second.reconstruction, truth);
    if (fit) score.adjusted = ErrorOf(adjusted->second.cam_from_world, real->second, *fit);
  }
  return scores;
}

std::string PhotoText(const PhotoScore& score) {
  std::string text = score.name + ": " + score.verdict + ", " + ErrorText(score.error) +
                     "; nearby " + ErrorText(score.nearby) + "; once added " +
                     ErrorText(score.adjusted);
  if (score.center_squares) {
    text += Format("; squares of the centre %.2f, of the pose %.2f", *score.center_squares,
                   *score.pose_squares);
  }
  if (score.focal_error_share) {
    text += Format("; focal length off by %.3f %%, %.1f standard deviations",
                   100 * *score.focal_error_share, *score.focal_deviations);
  }
  return text + Format("; %.0f ms\n", score.ms);
}

std::string Summary(const std::vector<PhotoScore>& scores) {
  std::vector<double> center, rotation, adjusted_center, adjusted_rotation, ms;
  std::vector<double> center_squares, pose_squares, nearby_center, nearby_rotation;
  std::vector<double> focal_percent, focal_squares;
  for (const PhotoScore& score : scores) {
    ms.push_back(score.ms);
    if (score.error) {
      center.push_back(score.error->center_m);
      rotation.push_back(score.error->rotation_deg);
    }
    if (score.nearby) {
      nearby_center.push_back(score.nearby->center_m);
      nearby_rotation.push_back(score.nearby->rotation_deg);
    }
    if (score.adjusted) {
      adjusted_center.push_back(score.adjusted->center_m);
      adjusted_rotation.push_back(score.adjusted->rotation_deg);
    }
    if (score.center_squares) center_squares.push_back(*score.center_squares);
    if (score.pose_squares) pose_squares.push_back(*score.pose_squares);
    if (!score.focal_error_share) continue;
    focal_percent.push_back(std::abs(100 * *score.focal_error_share));
    focal_squares.push_back(*score.focal_deviations * *score.focal_deviations);
  }
  const std::string focal =
      focal_percent.empty()
          ? ""
          : "focal length, %: " + Spread(focal_percent) +
                "; within 1.96 standard deviations: " + Inside(focal_squares, 1.96 * 1.96) + "\n";
  return Format("localised and scored: %zu of %zu photos\n", center.size(), scores.size()) + focal +
         "centre, m: " + Spread(center) + "\n" +
         "centre once added, m: " + Spread(adjusted_center) + "\n" +
         "centre against the images it rests on, m: " + Spread(nearby_center) + "\n" +
         "rotation, degrees: " + Spread(rotation) + "\n" +
         "rotation once added, degrees: " + Spread(adjusted_rotation) + "\n" +
         "rotation against the images it rests on, degrees: " + Spread(nearby_rotation) + "\n" +
         "centre inside the 95 % ellipsoid: " + Inside(center_squares, kCenterSquares95) + "\n" +
         "pose inside the 95 % ellipsoid: " + Inside(pose_squares, kPoseSquares95) + "\n" +
         "ms for each photo: " + Spread(ms) + "\n";
}

}  // namespace veduta::localization
