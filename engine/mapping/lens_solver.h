// SPDX-License-Identifier: Apache-2.0
#pragma once
// A bundle adjustment that refines lenses, too. It is wanted now and then, so Ceres solves it.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/bundle_problem.h"
#include "engine/mapping/lens_projection.h"

namespace veduta {

// The lenses of a bundle problem. What images that have one see lies, in the problem, in their
// photos as they were taken, and not where it is undistorted; their pinhole cameras do not count.
struct BundleLenses {
  std::vector<CameraModel> models;
  std::vector<std::optional<uint32_t>> of_image;  // which one; none: the image's camera is held
  std::vector<bool> keeps_distortion = {};        // those of which nothing is added to k1 and k2
};

// Refines all poses but the last one, all points, and the lenses. Focal lengths grow by 0.78 to
// 1.28 times at most, and at most 0.2 is added to k1 and k2 (LensChange). With Cauchy's loss of the
// options. The lenses' changes; nothing where it fails, and then nothing is changed. Deterministic,
// on one thread. O(iterations * (observations + images^3)), and less for images in a row.
std::optional<std::vector<LensChange>> SolveWithLenses(const BundleOptions& options,
                                                       const BundleLenses& lenses,
                                                       BundleProblem* problem);

}  // namespace veduta
