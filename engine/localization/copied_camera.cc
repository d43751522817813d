// SPDX-License-Identifier: Apache-2.0
#include "engine/localization/copied_camera.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "engine/camera/orientation.h"
#include "engine/camera/projection.h"
#include "engine/ingest/double_finder.h"

namespace veduta {
namespace {

// The camera of the photo as it is when what is stored is turned by this function of places.
template <typename Turn>
CameraModel Turned(const CameraModel& camera, const Turn& turn, ImageSize size) {
  CameraModel turned = camera;
  turned.width_px = size.width_px;
  turned.height_px = size.height_px;
  if (size.width_px != camera.width_px) std::swap(turned.fx, turned.fy);
  const Eigen::Vector2d principal = turn(Eigen::Vector2d(camera.cx, camera.cy)),
                        distortion = turn(Eigen::Vector2d(camera.u0, camera.v0));
  turned.cx = principal.x(), turned.cy = principal.y();
  turned.u0 = distortion.x(), turned.v0 = distortion.y();
  return turned;
}

CameraModel Scaled(const CameraModel& camera, ImageSize size) {
  CameraModel scaled = camera;
  scaled.width_px = size.width_px;
  scaled.height_px = size.height_px;
  const double across = static_cast<double>(size.width_px) / camera.width_px,
               down = static_cast<double>(size.height_px) / camera.height_px;
  scaled.fx *= across;
  scaled.fy *= down;
  for (double* x : {&scaled.cx, &scaled.u0}) *x = (*x + 0.5) * across - 0.5;
  for (double* y : {&scaled.cy, &scaled.v0}) *y = (*y + 0.5) * down - 0.5;
  return scaled;
}

// Up to rounding.
bool IsSame(const CameraModel& a, const CameraModel& b) {
  const auto is_near = [](double x, double y) {
    return std::abs(x - y) <= 1e-9 * (1 + std::abs(x));
  };
  return a.width_px == b.width_px && a.height_px == b.height_px && is_near(a.fx, b.fx) &&
         is_near(a.fy, b.fy) && is_near(a.cx, b.cx) && is_near(a.cy, b.cy) && is_near(a.k1, b.k1) &&
         is_near(a.k2, b.k2) && is_near(a.u0, b.u0) && is_near(a.v0, b.v0);
}

int NotedOrientation(int orientation) {
  return std::max(1, orientation);
}

}  // namespace

CameraModel CameraOfCopy(const CameraModel& camera, int orientation, ImageSize copy_size,
                         int copy_orientation) {
  const ImageSize size{camera.width_px, camera.height_px};
  const CameraModel upright = Turned(
      camera, [&](const auto& place) { return UprightFromStored(place, size, orientation); },
      UprightSize(size, NotedOrientation(orientation)));
  const CameraModel scaled =
      Scaled(upright, UprightSize(copy_size, NotedOrientation(copy_orientation)));
  return Turned(
      scaled,
      [&](const auto& place) { return StoredFromUpright(place, copy_size, copy_orientation); },
      copy_size);
}

Result<std::optional<CameraRecord>> FindCopiedCamera(const LocalizationParts& parts,
                                                     const PreparedPhoto& photo, ImageId image,
                                                     std::span<const FeatureMatch> matches) {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord stored, parts.snapshot->GetImage(image));
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, parts.snapshot->GetCamera(stored.camera));
  VEDUTA_ASSIGN_OR_RETURN(const auto features, parts.features->Get(*parts.snapshot, image));
  CameraModel plain;
  plain.width_px = photo.width_px;
  plain.height_px = photo.height_px;
  if (!MatchAsOnePicture({plain, photo.features, photo.orientation},
                         {camera.model, *features->features, stored.orientation}, matches)) {
    return std::optional<CameraRecord>();
  }
  CameraRecord copied;
  copied.model = CameraOfCopy(camera.model, stored.orientation, {photo.width_px, photo.height_px},
                              photo.orientation);
  if (!CheckCamera(copied.model).ok()) return std::optional<CameraRecord>();
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> known, parts.snapshot->ListCameras());
  const auto same = std::ranges::find_if(known, [&](const CameraRecord& one) {
    return IsSame(one.model, copied.model) && one.is_refinable == camera.is_refinable;
  });
  if (same != known.end()) return std::optional(std::move(*same));
  copied.name = camera.name + " at " + ImageSize{photo.width_px, photo.height_px}.Text();
  copied.source = "that of " + camera.name + ", of whose photos a copy came";
  copied.is_refinable = camera.is_refinable;
  copied.focal_stddev_share = camera.focal_stddev_share;
  return std::optional(std::move(copied));
}

}  // namespace veduta
