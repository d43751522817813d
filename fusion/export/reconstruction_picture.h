// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pictures of a reconstruction in the database, and the photos to compare them with.

#include <memory>

#include "fusion/surface/renderer.h"
#include "fusion/surface/reprojected_color.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// The camera of an image's photo, undistorted, its longer side `side_px` (0: as it is). kNotFound
// when it has no pose.
Result<ViewGeometry> PhotoGeometry(const Snapshot& snapshot, ImageId image, uint32_t side_px);

enum class Drawn : uint8_t { kSurfaceOrPoints, kPoints };

// A picture of a reconstruction: the surface, some tiles at a time, or the sparse points where
// there is none or they are asked for. kNotFound when the surface is asked for and there is none.
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
