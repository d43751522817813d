// SPDX-License-Identifier: Apache-2.0
#pragma once
// A street in three dimensions, ready to be looked at. Embree stays behind this header.

#include <memory>

#include "storage/base/status.h"
#include "tools/render/street/plan.h"
#include "tools/render/street/quad_mesh.h"
#include "tools/render/street/ray_table.h"
#include "tools/render/street/shader.h"

namespace veduta::street {

// Immutable once built; all its functions are thread-safe. World frame: metres, z up.
class Scene final {
 public:
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const SceneOptions& options() const;
  const Plan& plan() const;
  const QuadMesh& mesh() const;

  // The surface that each of sixteen rays from one origin meets first, or null.
  void Trace(const float origin[3], const float direction[3][kLanes],
             const Surface* surface[kLanes]) const;

  // The rays of a camera; the tables of the last few cameras are kept. Errors: as MakeRayTable.
  Result<std::shared_ptr<const RayTable>> Rays(const CameraModel& camera) const;

 private:
  friend Result<std::unique_ptr<Scene>> BuildScene(const SceneOptions& options);
  struct Parts;
  explicit Scene(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

// Builds houses, ground, trees and cars. Deterministic in the options. About 1 ms and 0.1 MB a
// metre of street. kInvalidArgument on bad options, kIoError if Embree cannot start or runs out of
// memory.
Result<std::unique_ptr<Scene>> BuildScene(const SceneOptions& options);

// Writes the geometry as a binary PLY of quads with one colour per face. kIoError with the path.
Status WriteMesh(const Scene& scene, const std::string& path);

}  // namespace veduta::street
