// SPDX-License-Identifier: Apache-2.0
#include "tools/floor/floor_photo.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "engine/camera/markers/marker_pattern.h"
#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"

namespace veduta::floor {
namespace {

constexpr int kNodeStepPx = 4;
// Neighbours whose light differs by more than this get 25 rays; the grain of wood differs by less.
constexpr float kEdge = 0.07f;
constexpr int kSamplesPerSide = 5;

// Rays of pixels and of places between them: exact at nodes 4 px apart, bilinear between, which is
// right to 1e-3 px.
class RayGrid final {
 public:
  static Result<RayGrid> Build(const CameraModel& model) {
    VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
    RayGrid grid;
    grid.columns_ = static_cast<int>(model.width_px) / kNodeStepPx + 3;
    const int rows = static_cast<int>(model.height_px) / kNodeStepPx + 3;
    grid.nodes_.reserve(static_cast<size_t>(grid.columns_) * rows);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < grid.columns_; ++i) {
        const auto px = UndistortPixel(model, Eigen::Vector2d(i - 1, j - 1) * kNodeStepPx);
        if (!px)
          return Status::InvalidArgument("the distortion folds over right at the photo's edge");
        grid.nodes_.push_back(NormalizedFromPixel(model, *px));
      }
    }
    return grid;
  }

  Eigen::Vector3d Ray(double u, double v) const {
    const double x = u / kNodeStepPx + 1, y = v / kNodeStepPx + 1;
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const double a = x - i, b = y - j;
    const Eigen::Vector2d* const n = &nodes_[static_cast<size_t>(j) * columns_ + i];
    const Eigen::Vector2d* const below = n + columns_;
    return ((1 - b) * ((1 - a) * n[0] + a * n[1]) + b * ((1 - a) * below[0] + a * below[1]))
        .homogeneous();
  }

 private:
  int columns_ = 0;
  std::vector<Eigen::Vector2d> nodes_;  // normalised coordinates
};

class Exposure final {
 public:
  Exposure(const Floor& floor, const FloorCamera& camera, const RayGrid& rays)
      : floor_(floor),
        rays_(rays),
        origin_(camera.cam_from_world.Center()),
        world_from_cam_(camera.cam_from_world.rotation.toRotationMatrix().transpose()),
        light_(static_cast<int>(camera.model.height_px), static_cast<int>(camera.model.width_px)) {}

  cv::Mat1f Take() {
    for (int v = 0; v < light_.rows; ++v) {
      for (int u = 0; u < light_.cols; ++u) light_(v, u) = See(u, v);
    }
    const cv::Mat1f centers = light_.clone();
    for (int v = 0; v < light_.rows; ++v) {
      for (int u = 0; u < light_.cols; ++u) {
        if (IsAtEdge(centers, u, v)) light_(v, u) = Closely(u, v);
      }
    }
    return light_;
  }

 private:
  float See(double u, double v) const {
    return floor_.Reflectance(origin_, world_from_cam_ * rays_.Ray(u, v));
  }

  static bool IsAtEdge(const cv::Mat1f& image, int u, int v) {
    const float here = image(v, u);
    for (int j = std::max(v - 1, 0); j <= std::min(v + 1, image.rows - 1); ++j) {
      for (int i = std::max(u - 1, 0); i <= std::min(u + 1, image.cols - 1); ++i) {
        if (std::abs(image(j, i) - here) > kEdge) return true;
      }
    }
    return false;
  }

  // The mean over the pixel's square.
  float Closely(int u, int v) const {
    // Each pixel has its own random places, so that edges share no pattern.
    SeededRandom random(MixSeed(static_cast<uint64_t>(u), static_cast<uint64_t>(v)));
    float sum = 0;
    for (int j = 0; j < kSamplesPerSide; ++j) {
      for (int i = 0; i < kSamplesPerSide; ++i) {
        sum += See(u - 0.5 + (i + random.Unit()) / kSamplesPerSide,
                   v - 0.5 + (j + random.Unit()) / kSamplesPerSide);
      }
    }
    return sum / (kSamplesPerSide * kSamplesPerSide);
  }

  const Floor& floor_;
  const RayGrid& rays_;
  const Eigen::Vector3d origin_;
  const Eigen::Matrix3d world_from_cam_;
  cv::Mat1f light_;
};

// A straight line of light, sampled finely and spread bilinearly; symmetric about the middle.
cv::Mat1f SmearKernel(double length_px, double angle_deg) {
  const int half = static_cast<int>(std::ceil(length_px / 2)) + 1;
  cv::Mat1f kernel(2 * half + 1, 2 * half + 1, 0.0f);
  const double angle = angle_deg * std::numbers::pi / 180;
  const int samples = 20 * static_cast<int>(std::ceil(length_px)) + 1;
  for (int i = 0; i < samples; ++i) {
    const double t = length_px * ((i + 0.5) / samples - 0.5);
    const double x = half + t * std::cos(angle), y = half + t * std::sin(angle);
    const int left = static_cast<int>(x), top = static_cast<int>(y);
    const double a = x - left, b = y - top;
    kernel(top, left) += static_cast<float>((1 - a) * (1 - b));
    kernel(top, left + 1) += static_cast<float>(a * (1 - b));
    kernel(top + 1, left) += static_cast<float>((1 - a) * b);
    kernel(top + 1, left + 1) += static_cast<float>(a * b);
  }
  return kernel / cv::sum(kernel)[0];
}

void Blur(const FloorPhotoOptions& options, cv::Mat1f* light) {
  if (options.blur_sigma_px > 0) {
    cv::GaussianBlur(*light, *light, {}, options.blur_sigma_px, options.blur_sigma_px,
                     cv::BORDER_REFLECT);
  }
  if (options.motion_px > 0) {
    cv::filter2D(*light, *light, CV_32F, SmearKernel(options.motion_px, options.motion_deg),
                 {-1, -1}, 0, cv::BORDER_REFLECT);
  }
}

// Light falls off towards the corners; a slope and the soft edge of a shadow lie across the floor.
void Illuminate(const FloorPhotoOptions& options, cv::Mat1f* light) {
  SeededRandom random(MixSeed(options.seed, 5));
  const double slope_rad = 2 * std::numbers::pi * random.Unit(),
               shadow_rad = 2 * std::numbers::pi * random.Unit();
  const double shadow_at = random.Unit() - 0.5, shadow_width = 0.02 + 0.1 * random.Unit();
  const double half = std::hypot(light->cols, light->rows) / 2;
  for (int v = 0; v < light->rows; ++v) {
    for (int u = 0; u < light->cols; ++u) {
      const double x = (u - light->cols / 2.0) / half, y = (v - light->rows / 2.0) / half;
      const double slope = 0.5 * (1 + x * std::cos(slope_rad) + y * std::sin(slope_rad));
      const double side = x * std::cos(shadow_rad) + y * std::sin(shadow_rad) - shadow_at;
      const double shadow = 0.5 * (1 + std::tanh(side / shadow_width));
      const double even = 1 - options.unevenness * (0.5 * slope + 0.5 * shadow);
      (*light)(v, u) *=
          static_cast<float>(options.exposure * even * (1 - options.vignetting * (x * x + y * y)));
    }
  }
}

cv::Mat Develop(const FloorPhotoOptions& options, cv::Mat1f light) {
  cv::min(light, 1.0, light);
  cv::max(light, 0.0, light);
  cv::pow(light, 1 / 2.2, light);
  cv::Mat1f noise(light.size());
  cv::RNG random(MixSeed(options.seed, 6));
  random.fill(noise, cv::RNG::NORMAL, 0.0, std::max(options.noise_sigma, 1e-9));
  cv::Mat photo;
  light = 255 * light + noise;
  light.convertTo(photo, CV_8U);
  return photo;
}

std::optional<Eigen::Vector2d> Project(const FloorCamera& camera, const Eigen::Vector3d& place_m) {
  const auto px = PixelFromBearing(camera.model, camera.cam_from_world * place_m);
  if (!px) return std::nullopt;
  const Eigen::Vector2d distorted = DistortPixel(camera.model, *px);
  // A place far outside can be bent back into the photo by a distortion that folds there.
  const auto back = UndistortPixel(camera.model, distorted);
  if (!back || (*back - *px).norm() > 1e-3) return std::nullopt;
  return distorted;
}

bool IsInPhoto(const CameraModel& model, const Eigen::Vector2d& px) {
  return px.x() >= 0 && px.y() >= 0 && px.x() <= model.width_px - 1.0 &&
         px.y() <= model.height_px - 1.0;
}

void LookAtOutline(const Floor& floor, const FloorCamera& camera, const FloorMarker& marker,
                   MarkerTruth* truth) {
  constexpr int kPlaces = 92;
  std::vector<Eigen::Vector2d> outline;
  int covered = 0, whole = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPlaces;
    const Eigen::Vector3d along(marker.radius_m * std::cos(angle),
                                marker.radius_m * std::sin(angle), 0);
    if (const auto px = Project(camera, marker.center_m + along)) outline.push_back(*px);
    const auto quiet = Project(camera, marker.center_m + kMarkerQuietRadius * along);
    whole += quiet && IsInPhoto(camera.model, *quiet);
    covered += floor.IsCovered((marker.center_m + 0.8 * along).head<2>());
  }
  truth->is_whole = whole == kPlaces;
  truth->cover = static_cast<double>(covered) / kPlaces;
  for (const Eigen::Vector2d& a : outline) {
    truth->outline_center_px += a / static_cast<double>(outline.size());
    for (const Eigen::Vector2d& b : outline)
      truth->diameter_px = std::max(truth->diameter_px, (a - b).norm());
  }
}

}  // namespace

Status FloorPhotoOptions::Check() const {
  const struct {
    const char* name;
    double value, low, high;
  } bounds[] = {{"noise_sigma", noise_sigma, 0, 64}, {"blur_sigma_px", blur_sigma_px, 0, 20},
                {"motion_px", motion_px, 0, 100},    {"motion_deg", motion_deg, -360, 360},
                {"vignetting", vignetting, 0, 1},    {"unevenness", unevenness, 0, 1},
                {"exposure", exposure, 0.05, 20}};
  for (const auto& bound : bounds) {
    if (!(bound.value >= bound.low && bound.value <= bound.high)) {
      return Status::InvalidArgument(std::string(bound.name) + " = " + std::to_string(bound.value) +
                                     " is not in [" + std::to_string(bound.low) + ", " +
                                     std::to_string(bound.high) + "]");
    }
  }
  return Status::Ok();
}

std::vector<MarkerTruth> TrueMarkers(const Floor& floor, const FloorCamera& camera) {
  std::vector<MarkerTruth> truths;
  const Eigen::Vector3d eye = camera.cam_from_world.Center();
  for (const FloorMarker& marker : floor.markers()) {
    const auto px = Project(camera, marker.center_m);
    if (!px || !IsInPhoto(camera.model, *px)) continue;
    MarkerTruth truth;
    truth.id = marker.id;
    truth.px = *px;
    const Eigen::Vector3d sight = (eye - marker.center_m).normalized();
    truth.tilt_deg = std::acos(std::clamp(sight.z(), -1.0, 1.0)) * 180 / std::numbers::pi;
    LookAtOutline(floor, camera, marker, &truth);
    truths.push_back(truth);
  }
  return truths;
}

Result<cv::Mat> RenderFloorPhoto(const Floor& floor, const FloorCamera& camera,
                                 const FloorPhotoOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_ASSIGN_OR_RETURN(const RayGrid rays, RayGrid::Build(camera.model));
  cv::Mat1f light = Exposure(floor, camera, rays).Take();
  Blur(options, &light);
  Illuminate(options, &light);
  return Develop(options, std::move(light));
}

}  // namespace veduta::floor
