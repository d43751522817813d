// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pictures of the surface and of points.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fusion/surface/model_writer.h"
#include "fusion/surface/ray_scene.h"
#include "storage/base/thread_pool.h"
#include "storage/model/view.h"

namespace veduta {

enum class Shading : uint8_t {
  kColor,   // the vertices' colours; a tile without any as kClay
  kClay,    // grey, lit from the camera: shows relief
  kNormal,  // world normals as colours: shows seams
};

enum class BackFaces : uint8_t { kDraw, kDarken, kCull };

struct RenderOptions {
  Shading shading = Shading::kColor;
  BackFaces back_faces = BackFaces::kDarken;
  std::array<uint8_t, 3> background = {255, 255, 255};
  double point_radius_px = 1.5;  // (0, 100]; of points' discs
  double depth_min = 1e-3;       // > 0, world units along z; nearer things are not drawn

  Status Check() const;  // the first violated bound, named with its value
};

struct Picture {
  uint32_t width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height x width x 3], row-major, sRGB
  std::vector<float> depth;  // [height x width] z in the camera frame; 0: background
};

// Nothing but background. kInvalidArgument on bad options, a size outside [1, 16384] each way, or a
// camera or pose that is not finite.
Result<Picture> BlankPicture(const ViewGeometry& view, const RenderOptions& options);

// Draws what is nearer than what the picture holds already, one ray through each pixel's centre: so
// a city may be drawn scene after scene. Smooth between vertices. Deterministic at any thread
// count. kInvalidArgument also if the picture is not of the view's size.
Status DrawSurface(const RayScene& scene, const ViewGeometry& view, const RenderOptions& options,
                   ThreadPool& pool, Picture* picture);

// As DrawSurface, but points, as discs that face the camera; of equally near ones the first stays.
Status DrawPoints(std::span<const CloudPoint> points, const ViewGeometry& view,
                  const RenderOptions& options, ThreadPool& pool, Picture* picture);

// A camera at `eye` that has `target` in its middle, `up` upwards, `fov_deg` across the picture's
// width. kInvalidArgument where these coincide or are not finite.
Result<ViewGeometry> LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                            const Eigen::Vector3d& up, uint32_t width_px, uint32_t height_px,
                            double fov_deg);

// Three views that hold all of `box`: along `forward` (the direction most photos look in), and
// turned by 50 degrees to the left and to the right around `up`; all from 20 degrees above. Errors:
// as LookAt.
Result<std::array<ViewGeometry, 3>> ThreeSides(const Eigen::AlignedBox3d& box,
                                               const Eigen::Vector3d& up,
                                               const Eigen::Vector3d& forward, uint32_t width_px,
                                               uint32_t height_px);

// The same camera with `factor` times the pixels each way.
ViewGeometry ScaledView(const ViewGeometry& view, double factor);
// `factor` x `factor` pixels into one, in light; the depth is the nearest one's. Sizes are rounded
// down.
Picture Reduced(const Picture& picture, uint32_t factor);

// kInvalidArgument if sizes do not fit, kIoError with the path.
Status WritePng(const std::string& path, uint32_t width_px, uint32_t height_px,
                std::span<const uint8_t> rgb);

}  // namespace veduta
