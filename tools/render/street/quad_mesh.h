// SPDX-License-Identifier: Apache-2.0
#pragma once
// The street's geometry: planar quads, each on a textured surface.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "storage/base/content_hash.h"
#include "tools/render/street/surface.h"

namespace veduta::street {

// A right-handed frame on a wall: `along` to the right as seen from outside, world z up, `outward`
// = along x z.
struct WallFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();

  Eigen::Vector3d outward() const { return along.cross(Eigen::Vector3d::UnitZ()); }
  Eigen::Vector3d At(double a, double out, double up) const {
    return origin + a * along + out * outward() + up * Eigen::Vector3d::UnitZ();
  }
  WallFrame Moved(double a, double out, double up) const { return {At(a, out, up), along}; }
};

// What a surface is made of; `tint` is the reflectance before light falls on it.
struct Finish {
  Material material = Material::kPlaster;
  Eigen::Vector3d tint = Eigen::Vector3d::Constant(0.5);
};

class QuadMesh final {
 public:
  // Adds a plane through `origin` spanned by the unit vectors u and v, outward u x v, lit by sun
  // and sky. `light` dims what lies in a recess. Returns its index.
  uint32_t AddSurface(const Eigen::Vector3d& origin, const Eigen::Vector3d& u,
                      const Eigen::Vector3d& v, const Finish& finish, uint32_t seed,
                      Eigen::Vector2d size = Eigen::Vector2d::Zero(), double light = 1.0);
  // The rectangle [s0, s1] x [t0, t1] of a surface, in m.
  void AddRect(uint32_t surface, double s0, double t0, double s1, double t1);
  // A triangle of a surface.
  void AddTriangle(uint32_t surface, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                   const Eigen::Vector2d& c);
  // A box in front of a wall: `size` is along, outward, up; its back is left open. `random` seeds
  // the five faces.
  void AddBox(const WallFrame& corner, const Eigen::Vector3d& size, const Finish& finish,
              SeededRandom& random);

  // Adds a copy of `part` with its origin and +x axis laid on those of `frame`. It keeps the light
  // that fell on it where it was made.
  void AddCopy(const QuadMesh& part, const WallFrame& frame);

  size_t quad_count() const { return surface_of_quad_.size(); }
  const std::vector<float>& vertices() const { return vertices_; }  // [4 quad_count x 3], world, m
  const std::vector<uint32_t>& surface_of_quad() const { return surface_of_quad_; }
  const std::vector<Surface>& surfaces() const { return surfaces_; }

 private:
  void AddVertex(uint32_t surface, double s, double t);

  std::vector<float> vertices_;
  std::vector<uint32_t> surface_of_quad_;
  std::vector<Surface> surfaces_;
};

}  // namespace veduta::street
