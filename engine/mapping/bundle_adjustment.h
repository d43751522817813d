// SPDX-License-Identifier: Apache-2.0
#pragma once
// Joint least-squares refinement of poses and points in the map (R18); bundle_solver.h solves it.

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/city_map.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct BundleSummary {
  uint32_t iterations = 0;  // steps tried
  uint64_t observations = 0;
  double initial_rms_px = 0, final_rms_px = 0;  // of the robustified, weighted errors
};

// Refines the poses of `free_images` and the positions of `points`. Every image in the points'
// tracks must be loaded; those that are not free are held where they are. Where no image is held,
// the frame is kept all the same: the result is carried back by the similarity that best fits the
// cameras to where they were, so that a published frame stays what it was. Deterministic with any
// number of threads; `pool` may be null. kInvalidArgument on bad options or when there is no usable
// step.
Result<BundleSummary> AdjustBundle(CityMap* map, std::span<const ImageId> free_images,
                                   std::span<const PointId> points, const BundleOptions& options,
                                   ThreadPool* pool);

struct LensFactor {
  double factor = 1;         // by how many times the focal length has grown
  double log_deviation = 0;  // its standard deviation over itself (LensDeviations)
};

// The same with all images free, where focal lengths are refined, too: `lens_of` says which images
// have one, and which of them have it in common, by numbers below `lens_count`. Features stay where
// they are. One that moves is drawn to where it was, as by an observation of one pixel at 3 % of
// it. All factors are 1, and nothing has moved, where there is no usable step. On one thread.
// kInvalidArgument on bad options.
Result<std::vector<LensFactor>> AdjustBundleWithLenses(
    CityMap* map, std::span<const ImageId> images, std::span<const PointId> points,
    const std::map<ImageId, uint32_t>& lens_of, uint32_t lens_count, const BundleOptions& options);

}  // namespace veduta
