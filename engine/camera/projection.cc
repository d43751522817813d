// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/projection.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "engine/camera/number_text.h"

namespace veduta {
namespace {

// Wider than any camera, so that only nonsense is refused; chosen by hand.
constexpr double kFocalPerSideMin = 0.01;      // of the longer side: 179 degrees of view
constexpr double kFocalPerSideMax = 1000.0;    // of the longer side: 0.06 degrees of view
constexpr double kDistortionFactorMax = 10.0;  // how much farther out a corner may be moved
constexpr double kCoefficientMax = 1e6;        // keeps the arithmetic below free of overflow
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The distortion is radial, so one dimension tells all: g(r) = r (1 + k1 r^2 + k2 r^4).
double Factor(const CameraModel& model, double r2) {
  return 1.0 + r2 * (model.k1 + model.k2 * r2);
}
double Radius(const CameraModel& model, double r) {
  return r * Factor(model, r * r);
}
double RadiusSlope(const CameraModel& model, double r) {
  const double r2 = r * r;
  return 1.0 + r2 * (3.0 * model.k1 + 5.0 * model.k2 * r2);
}

// The smallest r^2 > 0 with g'(r) = 1 + 3 k1 r^2 + 5 k2 r^4 = 0, where the image starts to fold
// over; infinite if none.
double FoldRadiusSquared(const CameraModel& model) {
  const double a = 5.0 * model.k2;
  const double b = 3.0 * model.k1;
  if (a == 0.0) return b < 0.0 ? -1.0 / b : kInfinity;
  const double discriminant = b * b - 4.0 * a;
  if (discriminant < 0.0) return kInfinity;
  // q has no cancellation; the roots are q / a and 1 / q.
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  double fold = kInfinity;
  for (const double root : {q / a, 1.0 / q}) {
    if (root > 0.0) fold = std::min(fold, root);
  }
  return fold;
}

Eigen::Vector2d CenterOfDistortion(const CameraModel& model) {
  return NormalizedFromPixel(model, {model.u0, model.v0});
}

// r^2 of the corner of the image (outer edge of the corner pixel) farthest from the centre of
// distortion.
double FarthestCornerSquared(const CameraModel& model) {
  const Eigen::Vector2d center = CenterOfDistortion(model);
  double farthest = 0.0;
  for (const double u : {-0.5, model.width_px - 0.5}) {
    for (const double v : {-0.5, model.height_px - 0.5}) {
      farthest = std::max(farthest, (NormalizedFromPixel(model, {u, v}) - center).squaredNorm());
    }
  }
  return farthest;
}

Status Wrong(const char* field, double value, const std::string& why) {
  return Status::InvalidArgument(std::string("camera: ") + field + " = " + NumberText(value) + " " +
                                 why);
}

Status CheckDistortion(const CameraModel& model) {
  if (!IsDistorted(model)) return Status::Ok();
  const std::string what = "camera: k1 = " + NumberText(model.k1) +
                           ", k2 = " + NumberText(model.k2) + ": the distortion ";
  const double corner = std::sqrt(FarthestCornerSquared(model));
  const double fold = std::sqrt(FoldRadiusSquared(model));
  if (corner >= fold) {
    return Status::InvalidArgument(what + "folds over at radius " + NumberText(fold) +
                                   " (normalised), inside the image, whose farthest corner is at " +
                                   NumberText(corner));
  }
  if (fold < kInfinity && Radius(model, fold) <= corner) {
    return Status::InvalidArgument(
        what + "moves nothing farther out than radius " + NumberText(Radius(model, fold)) +
        " (normalised), so no ray reaches the photo's farthest corner at " + NumberText(corner));
  }
  const double factor = Factor(model, corner * corner);
  if (!(factor > 0.0 && factor <= kDistortionFactorMax)) {
    return Status::InvalidArgument(what + "moves the farthest corner to " + NumberText(factor) +
                                   " times its radius; more than 10 times is not believed");
  }
  return Status::Ok();
}

// The r in [0, fold) with g(r) = distorted_radius > 0. Newton's method; a bracket catches it where
// it would leave.
std::optional<double> InvertRadius(const CameraModel& model, double distorted_radius) {
  constexpr int kIterationsMax = 200;  // bisection alone needs about 60
  constexpr double kStepMax = 1e-14;   // relative; well below the 1e-10 promised
  const double fold = std::sqrt(FoldRadiusSquared(model));
  double low = 0.0;
  double high = fold;
  if (fold < kInfinity) {
    if (!(Radius(model, fold) > distorted_radius)) return std::nullopt;
  } else {
    high = distorted_radius;
    for (int i = 0; Radius(model, high) < distorted_radius; ++i) {
      if (i == 64) return std::nullopt;
      high *= 2.0;
    }
  }
  double r = std::min(distorted_radius, high);
  for (int i = 0; i < kIterationsMax; ++i) {
    const double excess = Radius(model, r) - distorted_radius;
    if (excess == 0.0) return r;
    (excess > 0.0 ? high : low) = r;
    double next = r - excess / RadiusSlope(model, r);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double step = std::abs(next - r);
    r = next;
    if (step <= kStepMax * r) return r;
  }
  return r;
}

}  // namespace

Status CheckCamera(const CameraModel& model) {
  const auto check_side = [](const char* field, uint32_t side) {
    if (side >= 1 && side <= kCameraSideMax) return Status::Ok();
    return Wrong(field, side, "px is not in 1..65535");
  };
  VEDUTA_RETURN_IF_ERROR(check_side("width", model.width_px));
  VEDUTA_RETURN_IF_ERROR(check_side("height", model.height_px));
  struct Field {
    const char* name;
    double value, low, high;
    const char* why;
  };
  const double width = model.width_px;
  const double height = model.height_px;
  const double side = std::max(width, height);
  const double focal_min = kFocalPerSideMin * side;
  const double focal_max = kFocalPerSideMax * side;
  const char* const focal_why =
      "px is not a focal length for this size (0.01 to 1000 times the longer side)";
  const char* const center_why = "px is farther outside of the image than the image's size";
  const char* const coefficient_why = "is not a distortion coefficient (at most 1e6)";
  const std::array<Field, 8> fields = {
      {{"fx", model.fx, focal_min, focal_max, focal_why},
       {"fy", model.fy, focal_min, focal_max, focal_why},
       {"cx", model.cx, -width, 2.0 * width, center_why},
       {"cy", model.cy, -height, 2.0 * height, center_why},
       {"k1", model.k1, -kCoefficientMax, kCoefficientMax, coefficient_why},
       {"k2", model.k2, -kCoefficientMax, kCoefficientMax, coefficient_why},
       {"u0", model.u0, -width, 2.0 * width, center_why},
       {"v0", model.v0, -height, 2.0 * height, center_why}}};
  for (const Field& field : fields) {
    if (!std::isfinite(field.value))
      return Wrong(field.name, field.value, "is not a finite number");
    if (field.value < field.low || field.value > field.high)
      return Wrong(field.name, field.value, field.why);
  }
  return CheckDistortion(model);
}

bool IsDistorted(const CameraModel& model) {
  return model.k1 != 0.0 || model.k2 != 0.0;
}

Eigen::Vector2d DistortPixel(const CameraModel& model, const Eigen::Vector2d& undistorted_px) {
  if (!IsDistorted(model)) return undistorted_px;
  const Eigen::Vector2d center = CenterOfDistortion(model);
  const Eigen::Vector2d from_center = NormalizedFromPixel(model, undistorted_px) - center;
  return PixelFromNormalized(model,
                             center + from_center * Factor(model, from_center.squaredNorm()));
}

std::optional<Eigen::Vector2d> UndistortPixel(const CameraModel& model,
                                              const Eigen::Vector2d& distorted_px) {
  if (!distorted_px.allFinite()) return std::nullopt;
  if (!IsDistorted(model)) return distorted_px;
  const Eigen::Vector2d center = CenterOfDistortion(model);
  const Eigen::Vector2d from_center = NormalizedFromPixel(model, distorted_px) - center;
  const double distorted_radius = from_center.norm();
  if (distorted_radius == 0.0) return distorted_px;
  const std::optional<double> radius = InvertRadius(model, distorted_radius);
  if (!radius) return std::nullopt;
  return PixelFromNormalized(model, center + from_center * (*radius / distorted_radius));
}

bool IsInsidePhoto(const CameraModel& model, const Eigen::Vector2d& undistorted_px,
                   double margin_px) {
  if (!undistorted_px.allFinite()) return false;
  const double right = model.width_px - 1.0;
  const double bottom = model.height_px - 1.0;
  const double fold2 = FoldRadiusSquared(model);
  const Eigen::Vector2d center = CenterOfDistortion(model);
  const auto is_inside = [&](double u, double v) {
    const Eigen::Vector2d place(std::clamp(u, 0.0, right), std::clamp(v, 0.0, bottom));
    if ((NormalizedFromPixel(model, place) - center).squaredNorm() >= fold2) return false;
    const Eigen::Vector2d in_photo = DistortPixel(model, place);
    return in_photo.x() >= 0.0 && in_photo.x() <= right && in_photo.y() >= 0.0 &&
           in_photo.y() <= bottom;
  };
  // The border is a smooth curve that hardly bends over a few px: the circle is probed at eight
  // places.
  constexpr double kDiagonal = 0.70710678118654752;
  constexpr std::array<std::array<double, 2>, 9> kProbes = {{{0, 0},
                                                             {1, 0},
                                                             {-1, 0},
                                                             {0, 1},
                                                             {0, -1},
                                                             {kDiagonal, kDiagonal},
                                                             {kDiagonal, -kDiagonal},
                                                             {-kDiagonal, kDiagonal},
                                                             {-kDiagonal, -kDiagonal}}};
  return std::all_of(kProbes.begin(), kProbes.end(), [&](const std::array<double, 2>& probe) {
    return is_inside(undistorted_px.x() + probe[0] * margin_px,
                     undistorted_px.y() + probe[1] * margin_px);
  });
}

Eigen::Vector3d BearingFromPixel(const CameraModel& model, const Eigen::Vector2d& undistorted_px) {
  return NormalizedFromPixel(model, undistorted_px).homogeneous().normalized();
}

std::optional<Eigen::Vector2d> PixelFromBearing(const CameraModel& model,
                                                const Eigen::Vector3d& ray_in_cam) {
  if (!(ray_in_cam.z() > 0.0)) return std::nullopt;
  const Eigen::Vector2d px = PixelFromNormalized(model, ray_in_cam.hnormalized());
  if (!px.allFinite()) return std::nullopt;
  return px;
}

}  // namespace veduta
