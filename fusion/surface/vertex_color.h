// SPDX-License-Identifier: Apache-2.0
#pragma once
// The colour of every vertex, from the photos that truly see it.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/surface/color_view.h"
#include "fusion/surface/ray_scene.h"
#include "storage/base/option_fields.h"
#include "storage/base/thread_pool.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// Part of the version of every tile's colours: raise it whenever a change of the code changes what
// ColorVertices returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kColoringVersion = 1;

// The defaults were chosen by hand; not measured.
struct ColoringOptions {
  // > 0, world units. How exact the surface is; there is no default.
  double voxel_size = 0;
  // [0, 10]. Rays start this far out along the normal, so that the surface's own stairs do not hide
  // it.
  double offset_voxels = 1.0;
  // (0, 90), between the normal and the line of sight. Beyond, a photo sees nothing.
  double incidence_deg_max = 80;
  // (0, 1000]. A photo with wider pixels on the vertex says nothing about it.
  double voxels_per_pixel_max = 4;
  // [0, 1000]. A photo's weight falls to nothing over its outermost pixels.
  double border_margin_px = 8;
  // [0, 20]. The weight falls nearer than this to the outline of something in front, where photo
  // and surface may disagree about what is in front. 0: outlines are not looked at.
  double silhouette_margin_px = 2;
  // [1, 100], of the median absolute deviation. Beyond lie outliers: passers-by, cars, reflections.
  double outlier_deviations = 3;
  // [0, 1] of the sRGB range. Within it nothing is an outlier (noise, JPEG).
  double outlier_tolerance = 0.06;
  // [1, 255]. The views of most weight are taken.
  uint32_t views_per_vertex_max = 12;
  // How far colours spread into what no photo sees.
  uint32_t fill_rings_max = 1000;

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(ColoringOptions, voxel_size, offset_voxels, incidence_deg_max,
                     voxels_per_pixel_max, border_margin_px, silhouette_margin_px,
                     outlier_deviations, outlier_tolerance, views_per_vertex_max, fill_rings_max)

struct VertexColors {
  std::vector<std::array<uint8_t, 3>> colors;  // sRGB, one for each vertex
  // Photos behind each colour; 0: no photo sees the vertex, its colour is filled in.
  std::vector<uint8_t> view_counts;
};

// How far around a tile the scene must be whole: enlarge the tile's box by this before asking
// TilesBetween for it.
double ColoringReach(const ColoringOptions& options);

// Colours a tile.
//
// mesh    with a unit normal for each vertex. scene: all tiles between the tile's box, enlarged by
// ColoringReach, and the views
//         (tiles_between.h), the tile itself included.
// views   every photo that may see the tile (MaySee), in any order.
//
// A vertex's colour is a robust mean (robust_color.h) of the photos' light there, each weighted by
//   cos(incidence) * min(2, pixels a voxel)^2 * fade at the photo's border * (share of clear sight
//   around it)^2,
// a tenth of that where the photo is clipped. It depends on the position, the normal, and the
// photos that see the vertex alone, not on the rest of the tile nor on the order of views: two
// tiles that share a vertex, given the same views of it, give it the same colour. What no photo
// sees takes the mean of its coloured neighbours, ring by ring (up to fill_rings_max; grey 128
// beyond): that is a matter of one tile, and may differ on its border.
//
// Deterministic at any thread count. O(vertices * views * log(triangles)). Thread-safe.
// kInvalidArgument on bad options, a broken mesh (CheckMesh) or one without normals, or a null
// view.
Result<VertexColors> ColorVertices(const TriangleMesh& mesh, const RayScene& scene,
                                   std::span<const ColorView* const> views,
                                   const ColoringOptions& options, ThreadPool& pool);

}  // namespace veduta
