// SPDX-License-Identifier: Apache-2.0
#pragma once
// Joint least-squares refinement of poses and points (R18) in the map; bundle_solver.h does the
// work.

#include <cstdint>
#include <span>

#include "engine/mapping/map.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct BundleOptions {
  double loss_scale_px = 1.0;        // > 0: Cauchy loss; errors beyond it lose weight
  uint32_t iterations_max = 25;      // >= 1
  double function_tolerance = 1e-6;  // > 0: stop when the cost falls by less than this share
  uint32_t dense_images_max = 40;    // free images up to which the reduced camera system is dense

  Status Check() const;
};

struct BundleSummary {
  uint32_t iterations = 0;  // steps tried
  uint64_t observations = 0;
  double initial_rms_px = 0, final_rms_px = 0;  // of the robustified errors
};

// Refines the poses of `free_images` and the positions of `points`. Every image in the points'
// tracks must be loaded; those that are not free are held. Where no image is held, the gauge is
// kept: the result is carried back by the similarity that best fits the cameras to where they were,
// so a published frame stays what it was. Deterministic with any number of threads; `pool` may be
// null. kInvalidArgument on bad options or when there is no usable step.
Result<BundleSummary> AdjustBundle(Map* map, std::span<const ImageId> free_images,
                                   std::span<const PointId> points, const BundleOptions& options,
                                   ThreadPool* pool);

}  // namespace veduta
