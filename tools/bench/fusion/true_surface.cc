// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/fusion/true_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace veduta::fusion_benchmark {
namespace {

std::array<int, 3> CellOf(const Eigen::Vector3d& point, double cell) {
  return {static_cast<int>(std::floor(point.x() / cell)),
          static_cast<int>(std::floor(point.y() / cell)),
          static_cast<int>(std::floor(point.z() / cell))};
}

double DistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double length = along.squaredNorm();
  const double share = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0;
  return (p - a - share * along).norm();
}

double DistanceToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double area = normal.norm();
  if (area > 1e-12) {
    const Eigen::Vector3d n = normal / area;
    const bool is_above = (b - a).cross(p - a).dot(n) >= 0 && (c - b).cross(p - b).dot(n) >= 0 &&
                          (a - c).cross(p - c).dot(n) >= 0;
    if (is_above) return std::abs((p - a).dot(n));
  }
  return std::min(
      {DistanceToSegment(p, a, b), DistanceToSegment(p, b, c), DistanceToSegment(p, c, a)});
}

}  // namespace

TrueSurface::TrueSurface(const street::QuadMesh& mesh, double reach) : reach_(reach) {
  for (size_t q = 0; q < mesh.quad_count(); ++q) {
    Quad quad;
    for (int i = 0; i < 4; ++i) {
      const float* v = mesh.vertices().data() + 12 * q + 3 * i;
      quad.corners[i] = {v[0], v[1], v[2]};
    }
    Eigen::Vector3d low = quad.corners[0], high = low;
    for (const Eigen::Vector3d& corner : quad.corners) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(reach);
    const Cell from = CellOf(low - margin, reach), to = CellOf(high + margin, reach);
    const auto center_distance = [&](const Cell& cell) {
      const Eigen::Vector3d center =
          (Eigen::Vector3d(cell[0], cell[1], cell[2]) + Eigen::Vector3d::Constant(.5)) * reach;
      const auto& c = quad.corners;
      return std::min(DistanceToTriangle(center, c[0], c[1], c[2]),
                      DistanceToTriangle(center, c[0], c[2], c[3]));
    };
    for (int x = from[0]; x <= to[0]; ++x) {
      for (int y = from[1]; y <= to[1]; ++y) {
        for (int z = from[2]; z <= to[2]; ++z) {
          if (center_distance({x, y, z}) <= 1.9 * reach)
            cells_[{x, y, z}].push_back(static_cast<uint32_t>(quads_.size()));
        }
      }
    }
    quads_.push_back(quad);
  }
}

double TrueSurface::DistanceTo(const Eigen::Vector3d& point) const {
  double nearest = reach_;
  const auto found = cells_.find(CellOf(point, reach_));
  if (found == cells_.end()) return nearest;
  for (const uint32_t q : found->second) {
    const auto& c = quads_[q].corners;
    nearest = std::min({nearest, DistanceToTriangle(point, c[0], c[1], c[2]),
                        DistanceToTriangle(point, c[0], c[2], c[3])});
  }
  return nearest;
}

std::vector<TrueSurface::Sample> TrueSurface::SamplesWithin(double spacing,
                                                            const Eigen::Vector3d& low,
                                                            const Eigen::Vector3d& high) const {
  std::vector<Sample> samples;
  for (const Quad& quad : quads_) {
    const auto& c = quad.corners;
    const Eigen::Vector3d normal =
        (c[1] - c[0]).cross(c[2] - c[0]) + (c[2] - c[0]).cross(c[3] - c[0]);
    if (!(normal.norm() > 1e-12)) continue;
    const auto across = std::max(1, static_cast<int>(std::ceil((c[1] - c[0]).norm() / spacing)));
    const auto up = std::max(1, static_cast<int>(std::ceil((c[3] - c[0]).norm() / spacing)));
    for (int j = 0; j < up; ++j) {
      for (int i = 0; i < across; ++i) {
        const double s = (i + 0.5) / across, t = (j + 0.5) / up;
        const Eigen::Vector3d point =
            (1 - t) * ((1 - s) * c[0] + s * c[1]) + t * ((1 - s) * c[3] + s * c[2]);
        if ((point.array() < low.array()).any() || (point.array() > high.array()).any()) continue;
        samples.push_back({point, normal.normalized()});
      }
    }
  }
  return samples;
}

bool Sees(const RenderedMap& map, const TrueSurface::Sample& sample, double distance_max) {
  const Eigen::Vector3d in_cam = map.geometry.cam_from_world * sample.point;
  if (in_cam.z() <= 0 || in_cam.norm() > distance_max) return false;
  const Eigen::Vector3d towards = map.geometry.cam_from_world.Center() - sample.point;
  if (sample.normal.dot(towards.normalized()) < 0.17) return false;  // under 10 degrees
  const Eigen::Vector2d at = map.geometry.camera.Project(in_cam);
  const auto x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
  const int width = static_cast<int>(map.geometry.width_px),
            height = static_cast<int>(map.geometry.height_px);
  if (x < 1 || y < 1 || x >= width - 1 || y >= height - 1) return false;
  // The pixel's own depth differs from the point's where the surface is steep: any of the nearest
  // will do.
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      if (std::abs(map.truth.at(u, v) - in_cam.z()) < 0.005 * in_cam.z()) return true;
    }
  }
  return false;
}

PointGrid::PointGrid(const std::vector<Eigen::Vector3f>& points, double cell)
    : cell_(cell), points_(points) {
  for (uint32_t i = 0; i < points.size(); ++i)
    cells_[CellOf(points[i].cast<double>(), cell)].push_back(i);
}

bool PointGrid::HasNear(const Eigen::Vector3d& point, double distance) const {
  const std::array<int, 3> at = CellOf(point, cell_);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const auto found = cells_.find({at[0] + x, at[1] + y, at[2] + z});
        if (found == cells_.end()) continue;
        for (const uint32_t i : found->second) {
          if ((points_[i].cast<double>() - point).norm() <= distance) return true;
        }
      }
    }
  }
  return false;
}

}  // namespace veduta::fusion_benchmark
