// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth of one key view from its sensor views: plane sweep, scanline optimisation, refinement
// around what they find.
//
// 1. At half the size, planes z = const, evenly spaced in inverse depth, carry each sensor view
//    into the key view. How much census and gradient differ is the cost of a plane at a pixel; the
//    better view counts (Collins 1996; kernels/plane_sweep.h). Scanline optimisation along eight
//    directions chooses (Hirschmueller 2008; kernels/scanline.h). This tells how distinct each
//    pixel is, and which planes much of the view lies on: the ground, facades.
// 2. At the full size, planes z = const and families of planes parallel to those found compete in
//    one optimisation (after Gallup et al. 2007, with the directions found in the view itself).
// 3. The result, cleaned, is a surface to sweep along again: offsets from it in quarters of a px.
//    Windows follow its slant, and equal offsets cost nothing, so slanted surfaces are not cut
//    into steps (after Scharstein et al. 2017).
// A photo whose volume of costs is too large does 1 and 2 at half its size (or less) and 3 at every
// size above.

#include <cstdint>
#include <span>
#include <stop_token>

#include "fusion/depth/depth_range.h"
#include "kernels/device.h"
#include "storage/base/option_fields.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/model/depth_map.h"
#include "storage/model/view.h"

namespace veduta {

// Part of the version of every raw depth map: raise it whenever a change of the code changes what
// EstimateDepth returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kDepthEstimationVersion = 1;

// The defaults were chosen by what veduta-bench-dense (tools/bench/dense/) measured on pairs and on
// 12 key views of a rendered street (docs/dense.md, Figures). Those of volume_bytes_max and
// speckle_pixels_min were chosen by hand; no measurement is recorded.
struct DepthOptions {
  // [0.25, 8]. How far a point moves in a sensor view from plane to plane.
  double plane_step_px = 1.0;
  // [16, 768]. There are fewer, wider planes where the range would ask for more.
  uint32_t plane_count_max = 256;
  // [2^20, 2^36]. Costs in memory: what is larger is swept at half the size.
  uint64_t volume_bytes_max = 1ull << 30;
  // [0, 8]. Dominant planes of the view that are swept along, too.
  uint32_t slanted_plane_count = 4;
  // [0, 8]. Sweeps along the surface at the full size.
  uint32_t refinement_count = 1;
  // [0, 127] cost units, from a plane to the next.
  uint32_t penalty_small = 13;
  // [penalty_large_min, 128] cost units, to any other plane, at equal gray levels.
  uint32_t penalty_large = 95;
  // [0, 128] cost units, to any other plane, where gray levels jump.
  uint32_t penalty_large_min = 30;
  // [0, 255]. Depth of less confidence is given as not known.
  uint32_t confidence_min = 8;
  // Smaller patches of like depth are removed.
  uint32_t speckle_pixels_min = 40;

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(DepthOptions, plane_step_px, plane_count_max, volume_bytes_max,
                     slanted_plane_count, refinement_count, penalty_small, penalty_large,
                     penalty_large_min, confidence_min, speckle_pixels_min)

// What the costs of a key view take at most, which is most of what EstimateDepth takes.
uint64_t DepthVolumeBytes(const ViewGeometry& key, const DepthOptions& options);

// Depth and confidence of each pixel of `key`; not known (0) where no plane stands out and in
// patches too small. What no sensor view sees gets a depth too, if its neighbours suggest one:
// CheckConsistency takes it out again. `key` and `sensors` (1 to 16) have their gray images; sizes
// and cameras may differ. `far` may be infinite.
//
// device  null: C++ on the pool, which takes 1.5 times the processor time of PoCL. The answer is
// the same, bit for bit.
//
// Deterministic at any number of threads. Thread-safe. Errors: kInvalidArgument naming what is
// wrong with a view, the range or the options, or by how much the smallest volume exceeds
// volume_bytes_max; kIoError from the device; kCancelled soon after a stop request: the sweeps look
// at it (kernels/plane_sweep.h), and so does what stands between them.
Result<DepthMap> EstimateDepth(const View& key, std::span<const View> sensors,
                               const DepthRange& range, const DepthOptions& options, Device* device,
                               ThreadPool& pool, const std::stop_token& stop = {});

}  // namespace veduta
