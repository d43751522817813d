// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/surface/street_surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <unordered_map>

#include "storage/base/thread_pool.h"

namespace veduta::street {
namespace {

constexpr double kDepthTolerance = 0.01;

}  // namespace

TriangleMesh SurfaceOf(const Scene& scene, double spacing,
                       const std::function<bool(const Eigen::Vector3d&)>& is_wanted) {
  const QuadMesh& quads = scene.mesh();
  TriangleMesh mesh;
  for (size_t q = 0; q < quads.quad_count(); ++q) {
    Eigen::Vector3d corner[4];
    for (int k = 0; k < 4; ++k) {
      corner[k] = Eigen::Vector3f(quads.vertices().data() + 12 * q + 3 * k).cast<double>();
    }
    // Cells are decided one by one, so that of a long street's ground only a part is taken.
    const double along = std::max((corner[1] - corner[0]).norm(), (corner[2] - corner[3]).norm());
    const double across = std::max((corner[3] - corner[0]).norm(), (corner[2] - corner[1]).norm());
    const auto columns = static_cast<uint32_t>(std::max(1.0, std::ceil(along / spacing)));
    const auto rows = static_cast<uint32_t>(std::max(1.0, std::ceil(across / spacing)));
    const auto at = [&](double u, double v) -> Eigen::Vector3d {
      return (1 - v) * ((1 - u) * corner[0] + u * corner[1]) +
             v * ((1 - u) * corner[3] + u * corner[2]);
    };
    std::unordered_map<uint64_t, uint32_t> numbers;
    const Eigen::Vector3f normal(quads.surfaces()[quads.surface_of_quad()[q]].normal);
    const auto vertex = [&](uint32_t i, uint32_t j) {
      const auto next = static_cast<uint32_t>(mesh.positions.size());
      const auto [it, is_new] = numbers.try_emplace(uint64_t{j} << 32 | i, next);
      if (is_new) {
        mesh.positions.push_back(at(double{1} * i / columns, double{1} * j / rows).cast<float>());
        mesh.normals.push_back(normal);
      }
      return it->second;
    };
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
      const Eigen::Vector3f& p = mesh.positions[a];
      const Eigen::Vector3f turn = (mesh.positions[b] - p).cross(mesh.positions[c] - p);
      if (turn.norm() < 1e-9f) return;  // the fourth corner of a triangle
      if (turn.dot(normal) < 0) std::swap(b, c);
      mesh.triangles.push_back({a, b, c});
    };
    for (uint32_t j = 0; j < rows; ++j) {
      for (uint32_t i = 0; i < columns; ++i) {
        if (!is_wanted(at((i + 0.5) / columns, (j + 0.5) / rows))) continue;
        const uint32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1),
                       d = vertex(i, j + 1);
        add(a, b, c);
        add(a, c, d);
      }
    }
  }
  return mesh;
}

std::vector<MeshTile> CutIntoCubes(const TriangleMesh& mesh, double edge) {
  std::map<std::array<int, 3>, MeshTile> tiles;
  std::map<std::array<int, 3>, std::unordered_map<uint32_t, uint32_t>> numbers;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f middle =
        (mesh.positions[triangle[0]] + mesh.positions[triangle[1]] + mesh.positions[triangle[2]]) /
        3;
    std::array<int, 3> cell;
    for (int k = 0; k < 3; ++k) cell[k] = static_cast<int>(std::floor(middle[k] / edge));
    MeshTile& tile = tiles[cell];
    auto& number = numbers[cell];
    std::array<uint32_t, 3> own;
    for (int k = 0; k < 3; ++k) {
      const auto [it, is_new] =
          number.try_emplace(triangle[k], static_cast<uint32_t>(tile.keys.size()));
      own[k] = it->second;
      if (!is_new) continue;
      tile.keys.push_back(triangle[k]);
      tile.mesh.positions.push_back(mesh.positions[triangle[k]]);
      tile.mesh.normals.push_back(mesh.normals[triangle[k]]);
      if (!mesh.colors.empty()) tile.mesh.colors.push_back(mesh.colors[triangle[k]]);
    }
    tile.mesh.triangles.push_back(own);
  }
  std::vector<MeshTile> list;
  for (auto& [cell, tile] : tiles) list.push_back(std::move(tile));
  return list;
}

Result<std::vector<PhotoView>> TakeViews(const Scene& scene,
                                         const std::vector<StreetCamera>& cameras,
                                         const RenderOptions& options, uint32_t threads) {
  std::vector<PhotoView> views(cameras.size());
  std::mutex mutex;
  Status failure;
  ThreadPool pool(threads > 0 ? threads - 1 : 0);
  pool.ParallelFor(cameras.size(), [&](size_t i) {
    RenderOptions own = options;
    own.depth = true;
    own.seed = MixSeed(options.seed, i);
    Result<StreetPhoto> photo = RenderPhoto(scene, cameras[i], own);
    if (!photo.ok()) {
      const std::lock_guard lock(mutex);
      failure = photo.status();
      return;
    }
    const CameraModel& model = cameras[i].model;
    views[i].view = {ImageId(static_cast<uint32_t>(i + 1)),
                     {model.width_px, model.height_px, Pinhole(model), cameras[i].cam_from_world},
                     {},
                     std::move(photo->rgb)};
    views[i].depth = std::move(photo->depth);
  });
  if (!failure.ok()) return failure;
  return views;
}

std::vector<ColorObservation> ObserveVertices(const TriangleMesh& mesh,
                                              const std::vector<PhotoView>& photos, uint32_t step) {
  std::vector<ColorObservation> observations;
  for (uint32_t v = 0; v < mesh.positions.size(); v += step) {
    for (const PhotoView& photo : photos) {
      const ViewGeometry& g = photo.view.geometry;
      const Eigen::Vector3d in_cam = g.cam_from_world * mesh.positions[v].cast<double>();
      if (in_cam.z() < 0.1) continue;
      const Eigen::Vector2d px = g.camera.Project(in_cam);
      if (!(px.x() >= 0 && px.y() >= 0 && px.x() <= g.width_px - 1.0 &&
            px.y() <= g.height_px - 1.0))
        continue;
      const size_t at = static_cast<size_t>(std::lround(px.y())) * g.width_px +
                        static_cast<size_t>(std::lround(px.x()));
      if (std::abs(photo.depth[at] - in_cam.z()) > kDepthTolerance * in_cam.z()) continue;
      const uint8_t* const rgb = photo.view.rgb.data() + 3 * at;
      observations.push_back({photo.view.image, {ImageId(1), v}, {rgb[0], rgb[1], rgb[2]}});
    }
  }
  return observations;
}

}  // namespace veduta::street
