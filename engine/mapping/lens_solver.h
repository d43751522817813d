// SPDX-License-Identifier: Apache-2.0
#pragma once
// A bundle adjustment that refines focal lengths, too. It is wanted now and then, so Ceres solves
// it.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/bundle_problem.h"

namespace veduta {

// What a focal length is drawn to where it was by, over itself. Chosen by hand: what one photo
// tells is off by 2 % and more, and what photos in a row tell is little at first.
inline constexpr double kLensFocalShare = 0.03;

// Refines all poses but the last one, all points, and the focal lengths: `lens_of` says which of
// them an image has, if it is to be refined. `factors` are by how many times they grow, from 0.78
// to 1.28. With Cauchy's loss of the options. Where it fails (false) nothing is changed.
// Deterministic, on one thread. O(iterations * (observations + images^3)), and less for images in a
// row.
bool SolveWithLenses(const BundleOptions& options, std::span<const std::optional<uint32_t>> lens_of,
                     BundleProblem* problem, std::span<double> factors);

}  // namespace veduta
