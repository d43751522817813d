// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/calibrator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "engine/camera/calibration/calibration_advice.h"
#include "engine/camera/calibration/observation_choice.h"
#include "engine/camera/calibration/plane_reprojection_cost.h"
#include "engine/camera/calibration/readmission.h"
#include "engine/camera/calibration/scene_initialization.h"
#include "engine/camera/calibration/view_focal.h"
#include "engine/camera/projection.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Chosen by hand; not measured one by one (veduta-bench-calibration measures all together).
//
// The largest error of an observation, over the longer side: in the first round, where the
// initialization may be wrong by as much; and where a photo or a point gets a second chance.
constexpr double kFirstLimit = 0.02;
constexpr double kReadmittedLimit = 0.005;
constexpr double kRoundTolerance = 1e-5;  // of an adjustment that another one follows
// A photo is of another camera if its own focal length differs from the common one by this share
// and by this many standard deviations, and explains the photo to this RMS error, in sigma.
constexpr double kFocalDifferenceMin = 0.01;
constexpr double kFocalSigmas = 6;
constexpr double kOtherCameraErrorMax = 5;
// If more than this share of the photos are of other cameras, nobody knows which camera is meant.
constexpr double kOtherCameraShareMax = 0.3;
// fy differs from fx if their ratio differs from 1 by this many standard deviations and by this
// much.
constexpr double kAspectSigmas = 4, kAspectDifferenceMin = 1e-3;
// The largest standard deviation of the focal length, over it, that still is a calibration.
constexpr double kFocalSigmaMax = 0.05;

Status CheckInput(const CalibrationInput& input) {
  if (input.views.size() < 3) {
    return Status::InvalidArgument(
        "calibration: " + std::to_string(input.views.size()) +
        " photos are too few: take at least 8, from all around and tilted, 3 is the least");
  }
  const ViewObservations& first = input.views.front();
  for (const ViewObservations& view : input.views) {
    if (view.size.empty())
      return Status::InvalidArgument("calibration: photo '" + view.name + "' has no size");
    if (view.size != first.size) {
      const bool is_turned = view.size == ImageSize{first.size.height_px, first.size.width_px};
      return Status::InvalidArgument(
          "calibration: photo '" + view.name + "' is of " + view.size.Text() + " px, '" +
          first.name + "' of " + first.size.Text() +
          (is_turned ? ": hold the camera the same way round in all photos, or calibrate both ways"
                     : ": are these photos of two cameras? calibrate each with its own"));
    }
    for (const PointObservation& point : view.points) {
      if (point.px.allFinite() && point.sigma_px > 0 && std::isfinite(point.sigma_px)) continue;
      return Status::InvalidArgument("calibration: photo '" + view.name + "', point " +
                                     std::to_string(point.id) +
                                     ": the position or its sigma is not a usable number");
    }
  }
  return Status::Ok();
}

class Calibrator final {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options)
      : input_(input), options_(options) {}

  Result<Calibration> Run() {
    VEDUTA_RETURN_IF_ERROR(CheckInput(input_));
    VEDUTA_RETURN_IF_ERROR(Initialize());
    // Gross errors stand out better from round to round, for the scene gets better.
    VEDUTA_RETURN_IF_ERROR(Round(0));
    for (const double times : {4., 3., 2., 1.})
      VEDUTA_RETURN_IF_ERROR(Round(times * options_.outlier_sigmas));
    VEDUTA_RETURN_IF_ERROR(LeaveOutOtherCameras());
    VEDUTA_RETURN_IF_ERROR(Round(options_.outlier_sigmas));
    VEDUTA_RETURN_IF_ERROR(TryFreeAspect());
    VEDUTA_RETURN_IF_ERROR(CheckDetermined());
    Describe();
    made_.warnings = Advise(made_);
    const bool is_good = std::all_of(made_.warnings.begin(), made_.warnings.end(),
                                     [](const CalibrationWarning& w) { return w.IsNote(); });
    made_.status = is_good ? CalibrationStatus::kGood : CalibrationStatus::kUncertain;
    return std::move(made_);
  }

 private:
  Status Initialize() {
    planar_ = MakePlanarViews(input_);
    VEDUTA_ASSIGN_OR_RETURN(const InitialScene initial,
                            InitializeScene(planar_, input_.views.front().size));
    made_.focal_search_px = initial.focal_px;
    whole_.camera() = initial.camera;
    other_camera_.resize(input_.views.size());
    for (const std::optional<Rigid3>& pose : initial.metric.cams_from_world) {
      whole_.cams_from_world.push_back(pose.value_or(Unknown()));
    }
    whole_.points.assign(planar_.point_ids.size(), Eigen::Vector3d::Constant(std::nan("")));
    for (size_t p = 0; p < initial.metric.points.size(); ++p) {
      if (initial.metric.points[p]) whole_.points[p] << *initial.metric.points[p], 0;
    }
    for (size_t v = 0; v < planar_.views.size(); ++v) {
      for (const PlanarPoint& p : planar_.views[v]) {
        observations_.push_back({static_cast<uint32_t>(v), p.point, planar_.units.ToPx(p.x),
                                 p.sigma * planar_.units.unit_px});
      }
    }
    return Status::Ok();
  }

  static Rigid3 Unknown() {
    return {Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(std::nan(""))};
  }

  // The projected pixel minus the observed one, with the scene as it is. Not finite for a point
  // that is behind the camera, and for a point or a photo without a place.
  Eigen::Vector2d ResidualPx(const PlaneObservation& o) const {
    const CameraModel& c = whole_.camera();
    const std::array<double, kLensSize> lens = {c.fx, c.fy / c.fx, c.cx, c.cy,
                                                c.k1, c.k2,        c.u0, c.v0};
    const Rigid3& pose = whole_.cams_from_world[o.view];
    Eigen::Vector2d px;
    if (!PlaneReprojectionCost::Project(lens.data(), pose.rotation.coeffs().data(),
                                        pose.translation.data(), whole_.points[o.point].data(),
                                        px.data())) {
      return Eigen::Vector2d::Constant(std::nan(""));
    }
    return px - o.px;
  }

  // Chooses the observations whose errors are below `sigmas` times the usual error, and adjusts the
  // scene to them. With 0 the limit is kFirstLimit.
  Status Round(double sigmas) {
    if (sigmas > 0) PlaceWhatWasLeftOut(observations_, choice_, other_camera_, &whole_);
    std::vector<double> errors, in_sigma;
    for (size_t i = 0; i < observations_.size(); ++i) {
      errors.push_back(ResidualPx(observations_[i]).norm());
      if (sigmas > 0 && choice_.is_used[i])
        in_sigma.push_back(errors[i] / observations_[i].sigma_px);
    }
    if (sigmas > 0) {
      // The denominator is the median of Rayleigh's distribution.
      const double usual = MedianOf(in_sigma) / std::sqrt(2 * std::numbers::ln2);
      for (PlaneObservation& o : observations_) o.sigma_px *= std::max(usual, 1e-9);
    }
    const std::vector<bool> is_settled = Settled();
    for (size_t i = 0; i < errors.size(); ++i) {
      double limit =
          sigmas > 0 ? sigmas * observations_[i].sigma_px : kFirstLimit * planar_.units.unit_px;
      if (sigmas > options_.outlier_sigmas && !is_settled[i])
        limit = kReadmittedLimit * planar_.units.unit_px;
      errors[i] =
          std::isfinite(errors[i]) ? errors[i] / limit : std::numeric_limits<double>::infinity();
    }
    choice_.why_left_out = other_camera_;
    ChooseObservations(observations_, errors, {options_.photo_points_min, options_.photo_share_min},
                       &choice_);
    return Adjust(sigmas > 0 && sigmas <= options_.outlier_sigmas
                      ? options_.adjustment.function_tolerance
                      : kRoundTolerance);
  }

  // Of each observation, whether the last adjustment moved both its photo and its point to where
  // they fit.
  std::vector<bool> Settled() const {
    std::vector<bool> views(input_.views.size()), points(whole_.points.size()), settled;
    for (size_t i = 0; i < choice_.is_used.size(); ++i) {
      if (choice_.is_used[i]) views[observations_[i].view] = points[observations_[i].point] = true;
    }
    for (const PlaneObservation& o : observations_)
      settled.push_back(views[o.view] && points[o.point]);
    return settled;
  }

  Status Adjust(double tolerance) {
    CompactScene compact = Compact(observations_, choice_, whole_);
    if (compact.views.size() < 3) return TooFewLeft(compact.views.size());
    PlaneAdjustmentOptions adjustment = options_.adjustment;
    adjustment.function_tolerance = tolerance;
    VEDUTA_ASSIGN_OR_RETURN(adjustment_,
                            AdjustPlane(compact.observations, adjustment, &compact.scene));
    Expand(compact, &whole_);
    return Status::Ok();
  }

  Status TooFewLeft(size_t count) const {
    std::string message = "calibration: only " + std::to_string(count) + " of " +
                          std::to_string(input_.views.size()) +
                          " photos agree with each other, 3 is the least; left out:";
    for (size_t v = 0; v < input_.views.size(); ++v) {
      if (!choice_.why_left_out[v].empty())
        message += "\n  " + input_.views[v].name + ": " + choice_.why_left_out[v];
    }
    return Status::InvalidArgument(
        message + "\ndo not move the sheets between the photos, and keep them in focus");
  }

  // The view's own focal length if it is certainly another one.
  std::optional<ViewFocal> OtherFocal(const std::vector<PlaneObservation>& observations,
                                      const PlaneScene& scene, uint32_t view) const {
    const ViewFocal own = EstimateViewFocal(observations, scene, view);
    const double difference = std::abs(own.focal_px - scene.camera().fx);
    if (difference < kFocalDifferenceMin * scene.camera().fx ||
        difference < kFocalSigmas * own.sigma_px)
      return {};
    if (own.error_sigmas > kOtherCameraErrorMax) return {};  // that one does not explain it either
    return own;
  }

  void SetOtherCamera(uint32_t view, const ViewFocal& own) {
    other_camera_[view] = "taken with another focal length, about " +
                          std::to_string(std::lround(own.focal_px)) + " px instead of " +
                          std::to_string(std::lround(whole_.camera().fx)) +
                          " px: another camera or zoom";
  }

  // Leaves out the photos of other cameras one at a time, the most conspicuous first, because each
  // of them bends the focal lengths of all the others. Then says of photos that are out already,
  // for they fitted badly, whether another camera is the reason.
  Status LeaveOutOtherCameras() {
    for (;;) {
      const CompactScene compact = Compact(observations_, choice_, whole_);
      std::optional<ViewFocal> worst;
      uint32_t worst_view = 0;
      for (uint32_t v = 0; v < compact.views.size(); ++v) {
        const auto own = OtherFocal(compact.observations, compact.scene, v);
        const auto sigmas = [&](const ViewFocal& f) {
          return std::abs(f.focal_px - whole_.camera().fx) / f.sigma_px;
        };
        if (own && (!worst || sigmas(*own) > sigmas(*worst)))
          worst = own, worst_view = compact.views[v];
      }
      if (!worst) break;
      SetOtherCamera(worst_view, *worst);
      VEDUTA_RETURN_IF_ERROR(CheckNotMixed());
      VEDUTA_RETURN_IF_ERROR(Round(2 * options_.outlier_sigmas));
      VEDUTA_RETURN_IF_ERROR(Round(options_.outlier_sigmas));
    }
    const CompactScene compact = Compact(observations_, choice_, whole_);
    std::vector<PlaneObservation> of_known_points;
    for (const PlaneObservation& o : observations_) {
      if (std::binary_search(compact.points.begin(), compact.points.end(), o.point))
        of_known_points.push_back(o);
    }
    PlaceWhatWasLeftOut(observations_, choice_, other_camera_, &whole_);
    for (uint32_t v = 0; v < input_.views.size(); ++v) {
      const bool is_out = !choice_.why_left_out[v].empty() && other_camera_[v].empty();
      if (!is_out || !whole_.cams_from_world[v].translation.allFinite()) continue;
      if (const auto own = OtherFocal(of_known_points, whole_, v)) SetOtherCamera(v, *own);
    }
    return CheckNotMixed();
  }

  Status CheckNotMixed() const {
    const auto count = std::count_if(other_camera_.begin(), other_camera_.end(),
                                     [](const std::string& why) { return !why.empty(); });
    const double share = static_cast<double>(count) / static_cast<double>(input_.views.size());
    return share > kOtherCameraShareMax ? MixedCameras() : Status::Ok();
  }

  Status MixedCameras() const {
    std::string message = "calibration: the photos were taken with several cameras or zooms:";
    for (size_t v = 0; v < input_.views.size(); ++v) {
      if (!choice_.why_left_out[v].empty())
        message += "\n  " + input_.views[v].name + ": " + choice_.why_left_out[v];
    }
    return Status::InvalidArgument(
        message + "\ncalibrate each camera, at one zoom and focus, with its own photos");
  }

  Status TryFreeAspect() {
    CompactScene compact = Compact(observations_, choice_, whole_);
    PlaneAdjustmentOptions free = options_.adjustment;
    free.is_aspect_free = true;
    VEDUTA_ASSIGN_OR_RETURN(PlaneAdjustment adjusted,
                            AdjustPlane(compact.observations, free, &compact.scene));
    if (!adjusted.is_determined) return Status::Ok();
    const CameraModel& c = compact.scene.camera();
    const double aspect = c.fy / c.fx;
    const Eigen::Vector2d slope(-aspect / c.fx, 1 / c.fx);  // of the aspect by fx, fy
    const double sigma = std::sqrt(slope.dot(adjusted.covariance().topLeftCorner<2, 2>() * slope));
    made_.aspect_sigmas = std::abs(aspect - 1) / std::max(sigma, 1e-12);
    made_.is_aspect_free =
        made_.aspect_sigmas > kAspectSigmas && std::abs(aspect - 1) > kAspectDifferenceMin;
    if (!made_.is_aspect_free) return Status::Ok();
    adjustment_ = std::move(adjusted);
    Expand(compact, &whole_);
    return Status::Ok();
  }

  Status CheckDetermined() const {
    const double sigma = std::sqrt(adjustment_.covariance()(0, 0)) / whole_.camera().fx;
    CameraModel pinhole = whole_.camera();
    pinhole.k1 = pinhole.k2 = 0;
    const bool is_told =
        adjustment_.is_determined && sigma <= kFocalSigmaMax && CheckCamera(pinhole).ok();
    const Status usable = CheckCamera(whole_.camera());
    if (is_told && usable.ok()) return Status::Ok();
    if (is_told) {
      return Status::InvalidArgument(
          "calibration: the distortion cannot be told: what comes out is no camera (" +
          usable.message() +
          "). Photograph the corners: let the sheets fill the photo to "
          "its edges, and see that markers lie in every corner of some photo");
    }
    const std::string why = adjustment_.is_determined && sigma > kFocalSigmaMax
                                ? "it would be uncertain by " +
                                      std::to_string(std::lround(100 * std::min(sigma, 10.))) + " %"
                                : "the photos leave it open";
    return Status::InvalidArgument(
        "calibration: the focal length cannot be told: " + why +
        ". Tilt the camera: photos from all sides that look at the sheets at 30 to 50 "
        "degrees, beside a few from above; "
        "let the sheets fill the photo to its corners");
  }

  void Describe() {
    made_.model = whole_.camera();
    made_.covariance = adjustment_.covariance();
    for (const ViewObservations& view : input_.views) made_.photos.emplace_back().name = view.name;
    double sum = 0, sum2 = 0, count = 0;
    for (size_t i = 0; i < observations_.size(); ++i) {
      const PlaneObservation& o = observations_[i];
      const Eigen::Vector2d residual = ResidualPx(o);
      CalibrationPhoto& photo = made_.photos[o.view];
      made_.residuals.push_back(
          {o.view, planar_.point_ids[o.point], o.px, residual, choice_.is_used[i]});
      ++(choice_.is_used[i] ? photo.used_count : photo.left_out_count);
      if (!choice_.is_used[i]) continue;
      photo.error_px_rms += residual.squaredNorm();
      sum += residual.norm();
      sum2 += residual.squaredNorm();
      count += 1;
    }
    made_.error_px_mean = sum / count;
    made_.error_px_rms = std::sqrt(sum2 / count);
    DescribePhotos();
    made_.distortion_sigma_px = LargestDistortionSigma(made_.model, made_.covariance);
  }

  void DescribePhotos() {
    const CompactScene compact = Compact(observations_, choice_, whole_);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    const auto count = static_cast<double>(compact.scene.points.size());
    for (const Eigen::Vector3d& p : compact.scene.points) mean += p / count;
    double spread = 0, height = 0;
    for (const Eigen::Vector3d& p : compact.scene.points) {
      spread += (p - mean).squaredNorm() / count;
      height += p.z() * p.z() / count;
    }
    made_.height_rms = std::sqrt(height / spread);
    std::vector<double> distances;
    for (const Rigid3& pose : compact.scene.cams_from_world)
      distances.push_back((pose.Center() - mean).norm());
    const double usual = MedianOf(distances);
    for (size_t v = 0; v < made_.photos.size(); ++v) {
      CalibrationPhoto& photo = made_.photos[v];
      photo.why_left_out = choice_.why_left_out[v];
      if (!photo.why_left_out.empty()) continue;
      const Rigid3& pose = whole_.cams_from_world[v];
      photo.error_px_rms = std::sqrt(photo.error_px_rms / std::max(photo.used_count, 1u));
      const double cosine = std::abs(pose.rotation.toRotationMatrix()(2, 2));
      photo.tilt_deg = std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi;
      photo.distance = (pose.Center() - mean).norm() / usual;
    }
  }

  const CalibrationInput& input_;
  const CalibrationOptions options_;
  PlanarViews planar_;
  PlaneScene whole_;  // all views and points, also those that are not used
  std::vector<PlaneObservation> observations_;
  ObservationChoice choice_;
  // Of each view: why it is of another camera; empty for those that are not.
  std::vector<std::string> other_camera_;
  PlaneAdjustment adjustment_;
  Calibration made_;
};

}  // namespace

Status CalibrationOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("outlier_sigmas", outlier_sigmas, 2)
      .AtLeast("photo_points_min", photo_points_min, 4)
      .AboveUpTo("photo_share_min", photo_share_min, 0, 1)
      .Part("adjustment", adjustment.Check())
      .status();
}

Result<Calibration> CalibrateCamera(const CalibrationInput& input,
                                    const CalibrationOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  return Calibrator(input, options).Run();
}

}  // namespace veduta
