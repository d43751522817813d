// SPDX-License-Identifier: Apache-2.0
#pragma once
// Rays against the surface. Embree stays behind this header.
//
// A RayTile keeps one tile's mesh with its own hierarchy (a few ms to build); a RayScene joins
// tiles by instances, so that a scene of the tiles between a photo and a piece of surface costs
// microseconds, and tiles serve many scenes.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

inline constexpr int kRayLanes = 16;

// Sixteen rays: x(t) = origin + t direction, t in [t_near, t_far]. Lanes that are not live are
// neither traced nor read.
struct alignas(64) RayPacket {
  float origin[3][kRayLanes];     // world
  float direction[3][kRayLanes];  // world, of any length: t counts in its length
  float t_near[kRayLanes];
  float t_far[kRayLanes];
  bool live[kRayLanes];
};

// The first hit of each ray. `tile` is -1 where there is none, or the lane is not live.
struct alignas(64) RayHits {
  int32_t tile[kRayLanes];       // index in the scene's tiles
  uint32_t triangle[kRayLanes];  // of that tile's mesh
  float t[kRayLanes];
  float u[kRayLanes],
      v[kRayLanes];  // the point is (1 - u - v) a + u b + v c of the triangle's corners
};

// Embree's device: one a program is enough. Thread-safe.
class RayDevice final {
 public:
  // kIoError if Embree cannot start.
  static Result<std::shared_ptr<const RayDevice>> Open();
  ~RayDevice();
  RayDevice(const RayDevice&) = delete;
  RayDevice& operator=(const RayDevice&) = delete;

 private:
  friend class RayTile;
  friend class RayScene;
  RayDevice() = default;
  void* device_ = nullptr;
};

// A tile's mesh, ready for rays. Immutable, thread-safe.
class RayTile final {
 public:
  // Takes the mesh over. An empty mesh is valid and never hit. kInvalidArgument as CheckMesh
  // (mesh_check.h), kIoError if Embree runs out of memory. Builds in the calling thread: about 0.3
  // us and 100 bytes for each triangle.
  static Result<std::shared_ptr<const RayTile>> Make(std::shared_ptr<const RayDevice> device,
                                                     TriangleMesh mesh);
  ~RayTile();
  RayTile(const RayTile&) = delete;
  RayTile& operator=(const RayTile&) = delete;

  const TriangleMesh& mesh() const { return mesh_; }
  const Eigen::AlignedBox3f& box() const {
    return box_;
  }                           // of the positions; empty where there are none
  size_t size_bytes() const;  // of mesh and hierarchy, an estimate

 private:
  friend class RayScene;
  RayTile() = default;
  std::shared_ptr<const RayDevice> device_;
  TriangleMesh mesh_;
  Eigen::AlignedBox3f box_;
  void* scene_ = nullptr;
};

// Tiles together. Immutable, thread-safe.
class RayScene final {
 public:
  // All tiles must be of this device (kInvalidArgument). No tile is valid: nothing is ever hit.
  // kIoError if Embree runs out of memory. The tiles live as long as the scene.
  static Result<std::shared_ptr<const RayScene>> Make(
      std::shared_ptr<const RayDevice> device, std::vector<std::shared_ptr<const RayTile>> tiles);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  const std::vector<std::shared_ptr<const RayTile>>& tiles() const { return tiles_; }

  // The nearest hit of each live ray. Rays that miss by rounding where triangles meet are counted
  // as hits (Embree's robust mode). Call within a DenormalsOff.
  void Intersect(const RayPacket& rays, RayHits* hits) const;
  // Whether each live ray meets anything: bit i of the answer for lane i. Faster than Intersect.
  uint32_t Occluded(const RayPacket& rays) const;

 private:
  RayScene() = default;
  std::shared_ptr<const RayDevice> device_;
  std::vector<std::shared_ptr<const RayTile>> tiles_;
  void* scene_ = nullptr;
};

}  // namespace veduta
