// SPDX-License-Identifier: Apache-2.0
#pragma once
// The synthetic street as a surface of small triangles, and photos of it as views: truth for what
// colours and draws.

#include <functional>
#include <vector>

#include "fusion/surface/exposure.h"
#include "storage/model/triangle_mesh.h"
#include "storage/model/view.h"
#include "tools/render/street/camera_rig.h"
#include "tools/render/street/scene.h"

namespace veduta::street {

// Every quad whose middle `is_wanted`, divided into cells no larger than `spacing` metres; normals
// of the planes.
TriangleMesh SurfaceOf(const Scene& scene, double spacing,
                       const std::function<bool(const Eigen::Vector3d&)>& is_wanted);

struct MeshTile {
  TriangleMesh mesh;
  std::vector<uint64_t> keys;  // of vertices, equal where tiles share one
};
// Cut into cubes by the middles of triangles, in the order of their cells.
std::vector<MeshTile> CutIntoCubes(const TriangleMesh& mesh, double edge);

struct PhotoView {
  View view;  // with rgb
  std::vector<float> depth;
};
// Photos taken; `threads` at a time. The camera must have no distortion.
Result<std::vector<PhotoView>> TakeViews(const Scene& scene,
                                         const std::vector<StreetCamera>& cameras,
                                         const RenderOptions& options, uint32_t threads);

// What the photos see of every `step`th vertex, by their true depth: as sparse points would tell.
std::vector<ColorObservation> ObserveVertices(const TriangleMesh& mesh,
                                              const std::vector<PhotoView>& photos, uint32_t step);

}  // namespace veduta::street
