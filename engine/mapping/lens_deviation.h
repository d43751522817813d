// SPDX-License-Identifier: Apache-2.0
#pragma once
// How sure focal lengths are that were refined together with poses and points.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/bundle_problem.h"

namespace veduta {

// Standard deviations of the logarithms of focal lengths, where all poses and points are unknown,
// too: at the solution that SolveWithLenses has left, with its cameras as they are refined.
// `lens_of` is as there, and the result has `lens_count` numbers.
//
// Errors of features side by side are not independent, so the covariance is the cluster-robust one
// over cells of the pictures, as in CovarianceInNetwork (network_covariance.h), without its
// corrections for few cells. The weights are those of Cauchy's loss. What a lens was drawn to by
// the solver counts as well. 0 for a lens that the observations do not determine, and for all where
// the poses are left open. O(observations * (track length + lenses) + cells * lenses^2), and one
// factorisation of the poses. Deterministic.
std::vector<double> LensDeviations(const BundleOptions& options,
                                   std::span<const std::optional<uint32_t>> lens_of,
                                   uint32_t lens_count, const BundleProblem& problem);

}  // namespace veduta
