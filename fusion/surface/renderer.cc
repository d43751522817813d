// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "storage/base/denormals_off.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr uint32_t kSizeMax = 16384;
constexpr uint32_t kPacketSide = 4;  // a packet is 4 x 4 pixels: coherent
constexpr int kCulledMax = 64;       // back faces one behind the other that a ray goes through
constexpr float kBehind = 1e-5f;     // of the depth: where a ray goes on behind a face
constexpr float kDarkened = 0.4f;
constexpr size_t kPointBands = 16;

Status CheckView(const ViewGeometry& view) {
  if (view.width_px < 1 || view.height_px < 1 || view.width_px > kSizeMax ||
      view.height_px > kSizeMax) {
    return Status::InvalidArgument("picture: " + std::to_string(view.width_px) + "x" +
                                   std::to_string(view.height_px) + " px are outside [1, 16384]");
  }
  const Pinhole& c = view.camera;
  if (!(c.fx > 0 && c.fy > 0) || !std::isfinite(c.fx + c.fy + c.cx + c.cy)) {
    return Status::InvalidArgument("picture: impossible intrinsics");
  }
  if (!view.cam_from_world.translation.allFinite() ||
      !view.cam_from_world.rotation.coeffs().allFinite()) {
    return Status::InvalidArgument("picture: the camera's pose is not finite");
  }
  return {};
}

Status CheckPicture(const ViewGeometry& view, const RenderOptions& options,
                    const Picture& picture) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckView(view));
  const size_t pixels = size_t{view.width_px} * view.height_px;
  if (picture.width_px != view.width_px || picture.height_px != view.height_px ||
      picture.rgb.size() != 3 * pixels || picture.depth.size() != pixels) {
    return Status::InvalidArgument(
        "picture: it is not of the view's size; begin with BlankPicture");
  }
  return {};
}

uint8_t Byte(float value) {
  return static_cast<uint8_t>(std::clamp(value, 0.0f, 255.0f) + 0.5f);
}

// A ray's way through the scene, pixel by pixel of a packet.
class SurfacePainter final {
 public:
  SurfacePainter(const RayScene& scene, const ViewGeometry& view, const RenderOptions& options,
                 Picture* picture)
      : scene_(scene),
        view_(view),
        options_(options),
        picture_(picture),
        world_from_cam_(view.cam_from_world.rotation.toRotationMatrix().transpose().cast<float>()) {
    const Eigen::Vector3f center = view.cam_from_world.Center().cast<float>();
    for (int c = 0; c < 3; ++c) std::fill_n(rays_.origin[c], kRayLanes, center[c]);
  }

  void Paint(uint32_t u0, uint32_t v0);

 private:
  void Aim(uint32_t u0, uint32_t v0);
  size_t PixelOf(uint32_t u0, uint32_t v0, int lane) const {
    return size_t{v0 + lane / kPacketSide} * view_.width_px + u0 + lane % kPacketSide;
  }
  Eigen::Vector3f Direction(int lane) const {
    return {rays_.direction[0][lane], rays_.direction[1][lane], rays_.direction[2][lane]};
  }
  void Shade(int lane, size_t pixel);
  Eigen::Vector3f FaceNormal(int lane) const;

  const RayScene& scene_;
  const ViewGeometry& view_;
  const RenderOptions& options_;
  Picture* const picture_;
  const Eigen::Matrix3f world_from_cam_;
  RayPacket rays_;
  RayHits hits_;
};

void SurfacePainter::Aim(uint32_t u0, uint32_t v0) {
  for (int i = 0; i < kRayLanes; ++i) {
    const uint32_t u = u0 + i % kPacketSide, v = v0 + i / kPacketSide;
    rays_.live[i] = u < view_.width_px && v < view_.height_px;
    const Eigen::Vector2d x = view_.camera.Normalize(Eigen::Vector2d(u, v));
    const Eigen::Vector3f direction =
        world_from_cam_ * Eigen::Vector3f(static_cast<float>(x.x()), static_cast<float>(x.y()), 1);
    for (int c = 0; c < 3; ++c) rays_.direction[c][i] = direction[c];
    rays_.t_near[i] = static_cast<float>(options_.depth_min);
    const float there = rays_.live[i] ? picture_->depth[PixelOf(u0, v0, i)] : 0;
    rays_.t_far[i] = there > 0 ? there : std::numeric_limits<float>::infinity();
  }
}

Eigen::Vector3f SurfacePainter::FaceNormal(int lane) const {
  const TriangleMesh& mesh = scene_.tiles()[hits_.tile[lane]]->mesh();
  const auto& [a, b, c] = mesh.triangles[hits_.triangle[lane]];
  const Eigen::Vector3f& p = mesh.positions[a];
  return (mesh.positions[b] - p).cross(mesh.positions[c] - p);
}

void SurfacePainter::Shade(int lane, size_t pixel) {
  const TriangleMesh& mesh = scene_.tiles()[hits_.tile[lane]]->mesh();
  const auto& [a, b, c] = mesh.triangles[hits_.triangle[lane]];
  const float v = hits_.u[lane], w = hits_.v[lane], u = 1 - v - w;
  const bool is_back = FaceNormal(lane).dot(Direction(lane)) > 0;
  Eigen::Vector3f normal = mesh.normals.empty()
                               ? FaceNormal(lane)
                               : u * mesh.normals[a] + v * mesh.normals[b] + w * mesh.normals[c];
  normal.normalize();
  Eigen::Vector3f color;
  if (options_.shading == Shading::kNormal) {
    color = 127.5f * (normal + Eigen::Vector3f::Ones());
  } else if (options_.shading == Shading::kClay || mesh.colors.empty()) {
    const float facing = std::abs(normal.dot(Direction(lane).normalized()));
    color = Eigen::Vector3f::Constant(40 + 190 * facing);
  } else {
    const auto of = [&](uint32_t i) {
      return Eigen::Vector3f(mesh.colors[i][0], mesh.colors[i][1], mesh.colors[i][2]);
    };
    color = u * of(a) + v * of(b) + w * of(c);
  }
  if (is_back && options_.back_faces == BackFaces::kDarken) color *= kDarkened;
  picture_->depth[pixel] = hits_.t[lane];
  for (int k = 0; k < 3; ++k) picture_->rgb[3 * pixel + k] = Byte(color[k]);
}

void SurfacePainter::Paint(uint32_t u0, uint32_t v0) {
  Aim(u0, v0);
  for (int round = 0; round <= kCulledMax; ++round) {
    scene_.Intersect(rays_, &hits_);
    bool goes_on = false;
    for (int i = 0; i < kRayLanes; ++i) {
      if (!rays_.live[i]) continue;
      rays_.live[i] = false;
      if (hits_.tile[i] < 0) continue;
      if (options_.back_faces == BackFaces::kCull && FaceNormal(i).dot(Direction(i)) > 0) {
        rays_.live[i] = goes_on = true;
        rays_.t_near[i] = hits_.t[i] * (1 + kBehind);
        continue;
      }
      const size_t pixel = PixelOf(u0, v0, i);
      const float there = picture_->depth[pixel];
      if (there == 0 || hits_.t[i] < there) Shade(i, pixel);
    }
    if (!goes_on) return;
  }
}

struct Projected {
  Eigen::Vector2f px;
  float depth;  // 0: not in the picture
};

}  // namespace

Status RenderOptions::Check() const {
  return OptionBounds()
      .AboveUpTo("point_radius_px", point_radius_px, 0, 100)
      .FiniteAbove("depth_min", depth_min, 0)
      .status();
}

Result<Picture> BlankPicture(const ViewGeometry& view, const RenderOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckView(view));
  Picture picture = {view.width_px, view.height_px, {}, {}};
  const size_t pixels = size_t{view.width_px} * view.height_px;
  picture.depth.resize(pixels);
  picture.rgb.resize(3 * pixels);
  for (size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] = options.background[i % 3];
  return picture;
}

Status DrawSurface(const RayScene& scene, const ViewGeometry& view, const RenderOptions& options,
                   ThreadPool& pool, Picture* picture) {
  VEDUTA_RETURN_IF_ERROR(CheckPicture(view, options, *picture));
  pool.ParallelFor((view.height_px + kPacketSide - 1) / kPacketSide, [&](size_t band) {
    const DenormalsOff denormals_off;
    SurfacePainter painter(scene, view, options, picture);
    for (uint32_t u = 0; u < view.width_px; u += kPacketSide) {
      painter.Paint(u, static_cast<uint32_t>(band) * kPacketSide);
    }
  });
  return {};
}

Status DrawPoints(std::span<const CloudPoint> points, const ViewGeometry& view,
                  const RenderOptions& options, ThreadPool& pool, Picture* picture) {
  VEDUTA_RETURN_IF_ERROR(CheckPicture(view, options, *picture));
  const float radius = static_cast<float>(options.point_radius_px), square = radius * radius;
  const float right = static_cast<float>(view.width_px),
              bottom = static_cast<float>(view.height_px);
  std::vector<Projected> projected(points.size());
  constexpr size_t kTask = 4096;  // points; chosen by hand, not measured
  pool.ParallelFor((points.size() + kTask - 1) / kTask, [&](size_t task) {
    for (size_t i = task * kTask; i < std::min(points.size(), (task + 1) * kTask); ++i) {
      const Eigen::Vector3d x = view.cam_from_world * points[i].position.cast<double>();
      if (!(x.z() >= options.depth_min) || !x.allFinite()) continue;
      const Eigen::Vector2f px = view.camera.Project(x).cast<float>();
      const bool is_inside = px.x() > -radius - 1 && px.x() < right + radius &&
                             px.y() > -radius - 1 && px.y() < bottom + radius;
      if (is_inside) projected[i] = {px, static_cast<float>(x.z())};
    }
  });
  // Each task has rows of its own and all points in their order, so that nothing depends on who is
  // faster.
  const auto draw = [&](size_t i, int64_t first_row, int64_t last_row) {
    const auto& [px, depth] = projected[i];
    const int64_t v0 =
        std::max<int64_t>(first_row, static_cast<int64_t>(std::ceil(px.y() - radius)));
    const int64_t v1 =
        std::min<int64_t>(last_row - 1, static_cast<int64_t>(std::floor(px.y() + radius)));
    const int64_t u0 = std::max<int64_t>(0, static_cast<int64_t>(std::ceil(px.x() - radius)));
    const int64_t u1 =
        std::min<int64_t>(view.width_px - 1, static_cast<int64_t>(std::floor(px.x() + radius)));
    for (int64_t v = v0; v <= v1; ++v) {
      for (int64_t u = u0; u <= u1; ++u) {
        const Eigen::Vector2f off =
            Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v)) - px;
        if (off.squaredNorm() > square) continue;
        const size_t pixel = static_cast<size_t>(v) * view.width_px + static_cast<size_t>(u);
        float& there = picture->depth[pixel];
        if (there > 0 && depth >= there) continue;
        there = depth;
        std::copy(points[i].rgb.begin(), points[i].rgb.end(),
                  picture->rgb.begin() + static_cast<ptrdiff_t>(3 * pixel));
      }
    }
  };
  pool.ParallelFor(kPointBands, [&](size_t band) {
    const int64_t first = static_cast<int64_t>(view.height_px * band / kPointBands);
    const int64_t last = static_cast<int64_t>(view.height_px * (band + 1) / kPointBands);
    for (size_t i = 0; i < projected.size(); ++i) {
      if (projected[i].depth > 0) draw(i, first, last);
    }
  });
  return {};
}

}  // namespace veduta
