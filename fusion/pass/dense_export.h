// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reconstructions with their surfaces for other programs, and pictures of them.

#include <optional>
#include <string>
#include <vector>

#include "fusion/surface/reprojected_color.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

enum class ModelFormat : uint8_t { kPly, kGltf };

struct DenseExportOptions {
  ModelFormat format = ModelFormat::kPly;
  double error_max =
      0;  // >= 0, world units; triangles are joined while the surface moves no further; 0: all stay
};

struct ExportedSurface {
  ReconstructionId reconstruction;
  std::string folder;
  uint64_t images = 0, points = 0, vertices = 0, triangles = 0;  // no triangles: not densified yet
};

// Writes OUT/0, OUT/1, ... largest reconstruction first (ties: lower id):
//   ply   points.ply, mesh.ply where there is a surface, cameras.json and cameras.ply (pyramids)
//   gltf  model.glb with all of it, y up
// Holds the sparse points and one tile at a time. kAlreadyExists when OUT exists and is not empty;
// kIoError with the path.
Result<std::vector<ExportedSurface>> ExportSurfaces(const Snapshot& snapshot,
                                                    const std::string& out,
                                                    const DenseExportOptions& options,
                                                    ThreadPool& pool);

// The camera of an image's photo, undistorted, its longer side `side_px` (0: as it is). kNotFound
// when it has no pose.
Result<ViewGeometry> PhotoGeometry(const Snapshot& snapshot, ImageId image, uint32_t side_px);

// A box that holds 98 % of the surface along each axis, or of the points where there is none.
Result<Eigen::AlignedBox3d> BoxOf(const Snapshot& snapshot, ReconstructionId reconstruction);

enum class Drawn : uint8_t { kSurfaceOrPoints, kSurface, kPoints };

// A picture of a reconstruction: the surface, tiles by tiles, or the sparse points where there is
// none or they are asked for. kNotFound when the surface is asked for and there is none.
Result<Picture> DrawReconstruction(const Snapshot& snapshot, ReconstructionId reconstruction,
                                   Drawn drawn, const ViewGeometry& view,
                                   const RenderOptions& options, ThreadPool& pool);

// The photo of an image as a view of `side_px`, and the gain that its colours were balanced by.
struct BalancedPhoto {
  View view;
  Eigen::Vector3f gain;
};
Result<BalancedPhoto> LoadBalancedPhoto(std::shared_ptr<const Snapshot> snapshot, ImageId image,
                                        uint32_t side_px);

}  // namespace veduta
