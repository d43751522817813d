// SPDX-License-Identifier: Apache-2.0
#pragma once
// Completes tracks by known geometry: a point is projected into an image that does not see it yet,
// and a feature there that looks the same joins it.

#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/growth.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Projects `points` into a placed image. A point that lands near a feature that has no point yet
// and looks the same gets it as an observation. All images in the tracks of the points must be
// loaded.
GrowthCounts GrowByProjection(CityMap* map, ImageId image, std::span<const PointId> points,
                              const GrowthOptions& options);

// Does for one image after another what GrowByProjection does by all points that the
// `covisible_max` images see which share most points with it (CovisibleImages). What an image sees
// is found for many images side by side, and found again where an image before it has changed the
// track of a point in the meantime: so the answer is that of one thread, at any number of threads.
// A null pool means none. Memory is bounded by the points around some tens of images.
// Where `among` (ascending) is not empty, only these are asked for what they see.
GrowthCounts GrowAllByProjection(CityMap* map, std::span<const ImageId> images,
                                 std::span<const ImageId> among, size_t covisible_max,
                                 const GrowthOptions& options, ThreadPool* pool);

}  // namespace veduta
