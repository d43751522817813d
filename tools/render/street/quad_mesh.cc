// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/quad_mesh.h"

#include <algorithm>

namespace veduta::street {
namespace {

// Lambert's sun and a sky that gives more from above; independent of the viewer, so that a point
// keeps its colour.
double LightOn(const Eigen::Vector3d& normal) {
  static const Eigen::Vector3d sun = Eigen::Vector3d(0.46, -0.56, 0.69).normalized();
  return 0.62 + 0.14 * normal.z() + 0.55 * std::max(0.0, normal.dot(sun));
}

}  // namespace

uint32_t QuadMesh::AddSurface(const Eigen::Vector3d& origin, const Eigen::Vector3d& u,
                              const Eigen::Vector3d& v, const Finish& finish, uint32_t seed,
                              Eigen::Vector2d size, double light) {
  Surface surface = {};
  const Eigen::Vector3d normal = u.cross(v);
  Eigen::Map<Eigen::Vector3f>(surface.origin) = origin.cast<float>();
  Eigen::Map<Eigen::Vector3f>(surface.u) = u.cast<float>();
  Eigen::Map<Eigen::Vector3f>(surface.v) = v.cast<float>();
  Eigen::Map<Eigen::Vector3f>(surface.normal) = normal.cast<float>();
  Eigen::Map<Eigen::Vector3f>(surface.tint) =
      (finish.tint * (light * LightOn(normal))).cast<float>();
  Eigen::Map<Eigen::Vector2f>(surface.size) = size.cast<float>();
  surface.seed = seed;
  surface.material = finish.material;
  surfaces_.push_back(surface);
  return static_cast<uint32_t>(surfaces_.size() - 1);
}

void QuadMesh::AddVertex(uint32_t surface, double s, double t) {
  const Surface& plane = surfaces_[surface];
  for (int c = 0; c < 3; ++c) {
    vertices_.push_back(
        static_cast<float>(double{plane.origin[c]} + s * plane.u[c] + t * plane.v[c]));
  }
}

void QuadMesh::AddRect(uint32_t surface, double s0, double t0, double s1, double t1) {
  AddVertex(surface, s0, t0);
  AddVertex(surface, s1, t0);
  AddVertex(surface, s1, t1);
  AddVertex(surface, s0, t1);
  surface_of_quad_.push_back(surface);
}

void QuadMesh::AddTriangle(uint32_t surface, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                           const Eigen::Vector2d& c) {
  AddVertex(surface, a.x(), a.y());
  AddVertex(surface, b.x(), b.y());
  AddVertex(surface, c.x(), c.y());
  AddVertex(surface, c.x(), c.y());
  surface_of_quad_.push_back(surface);
}

void QuadMesh::AddBox(const WallFrame& corner, const Eigen::Vector3d& size, const Finish& finish,
                      SeededRandom& random) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), along = corner.along, out = corner.outward();
  const auto face = [&](const Eigen::Vector3d& origin, const Eigen::Vector3d& u,
                        const Eigen::Vector3d& v, double s, double t) {
    AddRect(AddSurface(origin, u, v, finish, static_cast<uint32_t>(random.Next()), {s, t}), 0, 0, s,
            t);
  };
  face(corner.At(0, size.y(), 0), along, up, size.x(), size.z());           // front
  face(corner.At(size.x(), size.y(), 0), -out, up, size.y(), size.z());     // right
  face(corner.At(0, 0, 0), out, up, size.y(), size.z());                    // left
  face(corner.At(0, size.y(), size.z()), along, -out, size.x(), size.y());  // top
  face(corner.At(0, 0, 0), along, out, size.x(), size.y());                 // underside
}

void QuadMesh::AddCopy(const QuadMesh& part, const WallFrame& frame) {
  Eigen::Matrix3d turn;
  turn << frame.along, -frame.outward(), Eigen::Vector3d::UnitZ();
  const auto put = [&](const float* from, const Eigen::Vector3d& shift, float* to) {
    const Eigen::Vector3d moved =
        turn * Eigen::Map<const Eigen::Vector3f>(from).cast<double>() + shift;
    Eigen::Map<Eigen::Vector3f> out(to);
    out = moved.cast<float>();
  };
  const uint32_t first = static_cast<uint32_t>(surfaces_.size());
  for (Surface surface : part.surfaces_) {
    put(surface.origin, frame.origin, surface.origin);
    for (float* const direction : {surface.u, surface.v, surface.normal})
      put(direction, Eigen::Vector3d::Zero(), direction);
    surfaces_.push_back(surface);
  }
  const size_t vertices = vertices_.size();
  vertices_.resize(vertices + part.vertices_.size());
  for (size_t i = 0; i < part.vertices_.size(); i += 3)
    put(&part.vertices_[i], frame.origin, &vertices_[vertices + i]);
  for (const uint32_t surface : part.surface_of_quad_) surface_of_quad_.push_back(first + surface);
}

}  // namespace veduta::street
