// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/furniture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tools/render/street/draws.h"

namespace veduta::street {
namespace {

constexpr double kCurbM = 0.12;
constexpr double kTileM = 40;

Eigen::Vector3d UnitVector(SeededRandom& random) {
  for (;;) {
    const Eigen::Vector3d x = Between(random, {-1, -1, -1}, {1, 1, 1});
    const double n = x.norm();
    if (n > 0.1 && n < 1) return x / n;
  }
}

// A trunk and a cloud of leafy twigs: every twig is a small plane of its own.
void AddTree(const WallFrame& foot, SeededRandom& random, QuadMesh& mesh) {
  const double trunk = Between(random, 2.1, 2.7), girth = Between(random, 0.16, 0.26);
  const Finish bark = {Material::kPlaster, Eigen::Vector3d(0.20, 0.15, 0.11)};
  mesh.AddBox(foot.Moved(-girth / 2, -girth / 2, 0), {girth, girth, trunk + 0.5}, bark, random);
  const Eigen::Vector3d radius = Between(random, {1.0, 1.0, 1.0}, {1.4, 1.35, 1.5});
  const Eigen::Vector3d crown = foot.At(0, 0, trunk + radius.z() * 0.8);
  const int twigs = 420 + static_cast<int>(random.Below(200));
  for (int i = 0; i < twigs; ++i) {
    const double outwards = std::cbrt(Between(random, 0.15, 1.0));
    const Eigen::Vector3d at = outwards * UnitVector(random);
    const Eigen::Vector3d normal = UnitVector(random);
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const double size = Between(random, 0.09, 0.24), green = Between(random, 0.14, 0.42);
    const double shade = 0.55 + 0.45 * (at.z() + 1) / 2;  // darker below
    const Finish leaf = {Material::kLeaf,
                         shade * green * Eigen::Vector3d(Between(random, 0.5, 0.9), 1.0, 0.35)};
    const Eigen::Vector3d center = crown + at.cwiseProduct(radius) - (u + v) * (size / 2);
    mesh.AddRect(mesh.AddSurface(center, u, v, leaf, static_cast<uint32_t>(random.Next())), 0, 0,
                 size, size);
  }
}

// The glass house of a car: a trapezoid seen from the side. `corner` lies below its rear end;
// `slant` is how far the roof is shorter at each end.
void AddCabin(const WallFrame& corner, double length, double width, double height, double slant,
              const Finish& glass, const Finish& paint, SeededRandom& random, QuadMesh& mesh) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), along = corner.along, out = corner.outward();
  const auto seed = [&] { return static_cast<uint32_t>(random.Next()); };
  const auto side = [&](const Eigen::Vector3d& origin, const Eigen::Vector3d& u) {
    const uint32_t surface = mesh.AddSurface(origin, u, up, glass, seed());
    mesh.AddRect(surface, slant, 0, length - slant, height);
    mesh.AddTriangle(surface, {0, 0}, {slant, 0}, {slant, height});
    mesh.AddTriangle(surface, {length - slant, 0}, {length, 0}, {length - slant, height});
  };
  side(corner.At(0, width, 0), along);
  side(corner.At(length, 0, 0), -along);
  const double pane = std::hypot(slant, height);
  const Eigen::Vector3d rear = (slant * along + height * up) / pane,
                        front = (height * up - slant * along) / pane;
  mesh.AddRect(mesh.AddSurface(corner.At(0, 0, 0), out, rear, glass, seed()), 0, 0, width, pane);
  mesh.AddRect(mesh.AddSurface(corner.At(length, width, 0), -out, front, glass, seed()), 0, 0,
               width, pane);
  mesh.AddBox(corner.Moved(slant, 0, height), {length - 2 * slant, width, 0.04}, paint, random);
}

void AddCar(const WallFrame& corner, SeededRandom& random, QuadMesh& mesh) {
  const double length = Between(random, 3.7, 4.5), width = 1.65, belt = Between(random, 0.78, 0.88);
  // Most cars are grey, some are not.
  const double level = Between(random, 0.06, 0.5), hue = random.Unit() < 0.4 ? 0.45 : 0.06;
  const double blue = 1 + Between(random, -hue, hue), red = 1 + Between(random, -hue, hue);
  const Finish paint = {Material::kPaint, level * Eigen::Vector3d(red, 1 - 0.5 * hue, blue)};
  const Finish glass = {Material::kPaint, Eigen::Vector3d(0.05, 0.06, 0.07)};
  const Finish rubber = {Material::kPaint, Eigen::Vector3d(0.03, 0.03, 0.03)};
  mesh.AddBox(corner.Moved(0, 0, 0.26), {length, width, belt - 0.26}, paint, random);
  AddCabin(corner.Moved(length * 0.17, 0.08, belt), length * 0.62, width - 0.16, 0.5, 0.42, glass,
           paint, random, mesh);
  for (const double at : {0.12, 0.74}) {
    mesh.AddBox(corner.Moved(length * at, -0.01, 0), {0.58, width + 0.02, 0.56}, rubber, random);
  }
  // AddBox leaves backs open; from the pavement's side the body needs one.
  const WallFrame back = {corner.At(length, 0, 0.26), -corner.along};
  const uint32_t side = mesh.AddSurface(back.origin, back.along, Eigen::Vector3d::UnitZ(), paint,
                                        static_cast<uint32_t>(random.Next()));
  mesh.AddRect(side, 0, 0, length, belt - 0.26);
}

}  // namespace

void AddGround(const Eigen::Vector2d& low, const Eigen::Vector2d& high, uint64_t seed,
               QuadMesh& mesh) {
  SeededRandom random(seed);
  const Finish asphalt = {Material::kAsphalt, Eigen::Vector3d(0.17, 0.17, 0.175)};
  for (double y = low.y(); y < high.y(); y += kTileM) {
    for (double x = low.x(); x < high.x(); x += kTileM) {
      const uint32_t tile =
          mesh.AddSurface({x, y, 0}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), asphalt,
                          static_cast<uint32_t>(random.Next()));
      mesh.AddRect(tile, 0, 0, std::min(kTileM, high.x() - x), std::min(kTileM, high.y() - y));
    }
  }
}

void AddPavement(const WallFrame& frame, double length_m, uint64_t seed, QuadMesh& mesh) {
  SeededRandom random(seed);
  const Finish slabs = {Material::kPavement, Eigen::Vector3d(0.33, 0.32, 0.30)};
  // From one corner's square to the other's start: going around a block, edges meet without
  // overlap.
  for (double at = -kPavementWidthM; at < length_m; at += kTileM) {
    mesh.AddBox(frame.Moved(at, 0, 0), {std::min(kTileM, length_m - at), kPavementWidthM, kCurbM},
                slabs, random);
  }
  for (double at = 5 + Between(random, 0, 4); at < length_m - 4; at += Between(random, 9, 15)) {
    AddTree(frame.Moved(at, 1.95, kCurbM), random, mesh);
  }
  for (double at = 4 + Between(random, 0, 14); at < length_m - 8; at += Between(random, 6, 26)) {
    AddCar(frame.Moved(at, kPavementWidthM + Between(random, 0.25, 0.35), 0), random, mesh);
  }
}

}  // namespace veduta::street
