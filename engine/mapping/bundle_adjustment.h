// SPDX-License-Identifier: Apache-2.0
#pragma once
// Joint least-squares refinement of poses and points in the map (R18); bundle_solver.h solves it.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/city_map.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/model/camera.h"

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

struct BundleLens {
  CameraModel model;
  double focal_stddev_share = 0;  // standard deviation of the focal length over itself; 0: unknown
};

// Gives an image of the map another lens, and the features that it leads to (CityMap::SetLens).
using LensSetter = std::function<Status(ImageId, const CameraModel&)>;

// The same with all images free, where focal lengths, k1 and k2 are refined, too: `lens_of` says
// which images have one of the lenses, which is the one that they have in the map. Each is drawn to
// where it was (kLensPriorSigmas). False, and nothing is changed, where there is no usable step, or
// none that leads to usable lenses; else they are refined in place. On one thread. kInvalidArgument
// on bad options; errors are those of `set_lens`, after which the map may be half changed.
Result<bool> AdjustBundleWithLenses(CityMap* map, std::span<const ImageId> images,
                                    std::span<const PointId> points,
                                    const std::map<ImageId, uint32_t>& lens_of,
                                    const BundleOptions& options, const LensSetter& set_lens,
                                    std::span<BundleLens> lenses);

}  // namespace veduta
