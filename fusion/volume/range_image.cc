// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/range_image.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr int kPlaneRadiusPx =
    3;  // 7x7 pixels: noise of depth of 1 % tilts the plane by some 20 degrees
constexpr double kJump = 0.03;  // of inverse depth: an edge; 1.3 % a pixel is a wall at 80 degrees
constexpr double kPlaneJump = 0.08;        // over the 7x7 pixels
constexpr double kFootprintVoxelsMax = 2;  // wider pixels say nothing about single voxels
constexpr double kTiltMin = 0.2;  // of the cosine between ray and normal: noise makes steep planes

Status CheckMap(const DepthMap& map, const ViewGeometry& geometry) {
  const size_t pixels = static_cast<size_t>(map.width_px) * map.height_px;
  if (map.width_px != geometry.width_px || map.height_px != geometry.height_px ||
      map.depth.size() != pixels || map.confidence.size() != pixels) {
    return Status::InvalidArgument("the depth map has " + std::to_string(map.width_px) + "x" +
                                   std::to_string(map.height_px) + " px, " +
                                   std::to_string(map.depth.size()) + " depths and " +
                                   std::to_string(map.confidence.size()) +
                                   " confidences, its view " + std::to_string(geometry.width_px) +
                                   "x" + std::to_string(geometry.height_px) + "; all must agree");
  }
  const Pinhole& c = geometry.camera;
  if (!(c.fx > 0 && c.fy > 0) || !std::isfinite(c.fx + c.fy + c.cx + c.cy)) {
    return Status::InvalidArgument("the depth map's camera has no positive focal length");
  }
  for (const float depth : map.depth) {
    if (!(depth >= 0) || !std::isfinite(depth)) {
      return Status::InvalidArgument("a depth is " + std::to_string(depth) +
                                     "; it must be positive, or 0 if not known");
    }
  }
  return Status::Ok();
}

struct Slope {
  double along_x = 0, along_y = 0;  // of inverse depth, per pixel
};

// Least squares over the window's pixels that belong to the same surface.
Slope FitSlope(const std::vector<float>& inverse_depth, int width, int height, int x, int y) {
  const double center = inverse_depth[static_cast<size_t>(y) * width + x];
  double n = 0, sx = 0, sy = 0, si = 0, sxx = 0, sxy = 0, syy = 0, sxi = 0, syi = 0;
  for (int v = std::max(0, y - kPlaneRadiusPx); v <= std::min(height - 1, y + kPlaneRadiusPx);
       ++v) {
    for (int u = std::max(0, x - kPlaneRadiusPx); u <= std::min(width - 1, x + kPlaneRadiusPx);
         ++u) {
      const double i = inverse_depth[static_cast<size_t>(v) * width + u];
      if (std::abs(i - center) > kPlaneJump * center) continue;
      const double dx = u - x, dy = v - y, di = i - center;
      n += 1, sx += dx, sy += dy, si += di;
      sxx += dx * dx, sxy += dx * dy, syy += dy * dy, sxi += dx * di, syi += dy * di;
    }
  }
  const double a = sxx - sx * sx / n, b = sxy - sx * sy / n, c = syy - sy * sy / n;
  const double p = sxi - sx * si / n, q = syi - sy * si / n;
  const double determinant = a * c - b * b;
  if (!(determinant > 1e-3 * (a + c) * (a + c)))
    return {};  // one pixel, or a line of them: the plane is taken to face the camera
  return {(p * c - q * b) / determinant, (q * a - p * b) / determinant};
}

// For the plane with inverse depth i = A x + B y + C at normalised image coordinates (x, y), a
// point of the pixel's ray at depth z lies (D - z) i / |(A, B, C)| from the plane that the ray
// meets at depth D = 1 / i.
double TiltOf(const Pinhole& camera, int x, int y, double inverse_depth, const Slope& slope) {
  const Eigen::Vector2d at = camera.Normalize(Eigen::Vector2d(x, y));
  const double a = slope.along_x * camera.fx, b = slope.along_y * camera.fy;
  const double c = inverse_depth - a * at.x() - b * at.y();
  return std::max(inverse_depth / std::sqrt(a * a + b * b + c * c), kTiltMin);
}

}  // namespace

Result<RangeImage> RangeImage::Make(const DepthMap& map, const ViewGeometry& geometry) {
  VEDUTA_RETURN_IF_ERROR(CheckMap(map, geometry));
  RangeImage image;
  image.geometry_ = geometry;
  image.rotation_ = geometry.cam_from_world.rotation.toRotationMatrix();
  const size_t pixels = map.depth.size();
  image.inverse_depth_.assign(pixels, 0.f);
  image.tilt_.assign(pixels, 0.f);
  image.confidence_.assign(pixels, 0);
  for (size_t i = 0; i < pixels; ++i) {
    if (map.depth[i] <= 0 || map.confidence[i] == 0) continue;
    const float inverse = 1.f / map.depth[i];
    if (!std::isfinite(inverse)) continue;
    image.inverse_depth_[i] = inverse;
    image.confidence_[i] = map.confidence[i];
    image.depth_max_ = std::max(image.depth_max_, map.depth[i]);
  }
  const int width = static_cast<int>(map.width_px), height = static_cast<int>(map.height_px);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y) * width + x;
      if (image.inverse_depth_[i] == 0) continue;
      const Slope slope = FitSlope(image.inverse_depth_, width, height, x, y);
      image.tilt_[i] =
          static_cast<float>(TiltOf(geometry.camera, x, y, image.inverse_depth_[i], slope));
    }
  }
  return image;
}

std::optional<RangeVote> RangeImage::VoteOn(const Eigen::Vector3d& point_in_world,
                                            const VolumeGrid& grid) const {
  const Eigen::Vector3d point = rotation_ * point_in_world + geometry_.cam_from_world.translation;
  if (point.z() <= 0) return std::nullopt;
  const Eigen::Vector2d at = geometry_.camera.Project(point);
  const double width = geometry_.width_px, height = geometry_.height_px;
  if (!(at.x() > -0.5 && at.y() > -0.5 && at.x() < width - 0.5 && at.y() < height - 0.5))
    return std::nullopt;
  const size_t stride = geometry_.width_px;
  const auto nearest_x = static_cast<size_t>(at.x() + 0.5),
             nearest_y = static_cast<size_t>(at.y() + 0.5);
  const size_t nearest = nearest_y * stride + nearest_x;
  double inverse = inverse_depth_[nearest];
  if (inverse == 0) return std::nullopt;
  if (at.x() >= 0 && at.y() >= 0 && at.x() < width - 1 && at.y() < height - 1) {
    const auto x = static_cast<size_t>(at.x()), y = static_cast<size_t>(at.y());
    const size_t i = y * stride + x;
    const double i00 = inverse_depth_[i], i10 = inverse_depth_[i + 1];
    const double i01 = inverse_depth_[i + stride], i11 = inverse_depth_[i + stride + 1];
    const double low = std::min({i00, i10, i01, i11}), high = std::max({i00, i10, i01, i11});
    if (low > 0 && high - low <= kJump * high) {
      const double fx = at.x() - static_cast<double>(x), fy = at.y() - static_cast<double>(y);
      inverse = (1 - fy) * ((1 - fx) * i00 + fx * i10) + fy * ((1 - fx) * i01 + fx * i11);
    }
  }
  RangeVote vote;
  const double tilt = tilt_[nearest];
  vote.distance = (1 / inverse - point.z()) * tilt;
  if (vote.distance < -grid.truncation()) return std::nullopt;
  const double footprint = point.z() / (geometry_.camera.focal_px() * grid.voxel_size);
  if (footprint > kFootprintVoxelsMax) return std::nullopt;
  // What a pixel says is spread over its footprint; on the surface a tilt spreads it further.
  double share = confidence_[nearest] / 255.0 / std::max(1.0, footprint * footprint);
  if (vote.distance <= grid.truncation()) share *= std::min(1.0, tilt);
  vote.weight =
      std::clamp(static_cast<uint32_t>(std::ceil(kVoteWeightMax * share)), 1u, kVoteWeightMax);
  return vote;
}

bool RangeImage::MaySee(const GridPlace& block, const VolumeGrid& grid) const {
  if (depth_max_ == 0) return false;
  const double side = kBlockSide * grid.voxel_size;
  const double radius = 0.5 * std::sqrt(3.0) * side;
  const Eigen::Vector3d corner(block.x, block.y, block.z);
  const Eigen::Vector3d center = rotation_ * ((corner + Eigen::Vector3d::Constant(0.5)) * side) +
                                 geometry_.cam_from_world.translation;
  if (center.z() < -radius || center.z() > depth_max_ + grid.truncation() / kTiltMin + radius)
    return false;
  // Distance from each side plane of the frustum, pixels' halves included.
  const Pinhole& camera = geometry_.camera;
  const Eigen::Vector2d low = camera.Normalize(Eigen::Vector2d(-0.5, -0.5));
  const Eigen::Vector2d high =
      camera.Normalize(Eigen::Vector2d(geometry_.width_px - 0.5, geometry_.height_px - 0.5));
  for (int axis = 0; axis < 2; ++axis) {
    const double to_low =
        (center[axis] - low[axis] * center.z()) / std::sqrt(1 + low[axis] * low[axis]);
    const double to_high =
        (high[axis] * center.z() - center[axis]) / std::sqrt(1 + high[axis] * high[axis]);
    if (to_low < -radius || to_high < -radius) return false;
  }
  return true;
}

std::vector<NamedBlock> RangeImage::BlocksNearSurface(const VolumeGrid& grid) const {
  std::map<GridPlace, uint32_t> named;
  const Rigid3 world_from_cam = geometry_.cam_from_world.Inverse();
  const Eigen::Matrix3d rotation = world_from_cam.rotation.toRotationMatrix();
  const double side = kBlockSide * grid.voxel_size;
  const Eigen::Array3d reach = Eigen::Array3d::Constant(grid.truncation());
  uint32_t* last_count = nullptr;  // neighbouring pixels mostly name one and the same block
  GridPlace last;
  const auto name = [&](const GridPlace& block) {
    if (!last_count || block != last) {
      last = block;
      last_count = &named[block];
    }
    ++*last_count;
  };
  for (uint32_t y = 0; y < geometry_.height_px; ++y) {
    for (uint32_t x = 0; x < geometry_.width_px; ++x) {
      const size_t i = static_cast<size_t>(y) * geometry_.width_px + x;
      if (inverse_depth_[i] == 0) continue;
      const double depth = 1.0 / inverse_depth_[i];
      if (depth > kFootprintVoxelsMax * geometry_.camera.focal_px() * grid.voxel_size) continue;
      const Eigen::Vector2d at = geometry_.camera.Normalize(Eigen::Vector2d(x, y));
      const Eigen::Vector3d in_world =
          rotation * Eigen::Vector3d(at.x() * depth, at.y() * depth, depth) +
          world_from_cam.translation;
      const Eigen::Array3d from = ((in_world.array() - reach) / side).floor();
      const Eigen::Array3d to = ((in_world.array() + reach) / side).floor();
      if (!(from.abs().maxCoeff() < kBlockCoordinateMax &&
            to.abs().maxCoeff() < kBlockCoordinateMax))
        continue;
      const Eigen::Array3i low = from.cast<int32_t>(), high = to.cast<int32_t>();
      for (int32_t bx = low.x(); bx <= high.x(); ++bx) {
        for (int32_t by = low.y(); by <= high.y(); ++by) {
          for (int32_t bz = low.z(); bz <= high.z(); ++bz) name({bx, by, bz});
        }
      }
    }
  }
  std::vector<NamedBlock> blocks;
  for (const auto& [block, count] : named) blocks.push_back({block, count});
  return blocks;
}

}  // namespace veduta
