// SPDX-License-Identifier: Apache-2.0
#pragma once
// How sure focal lengths are that were refined together with poses and points.

#include <vector>

#include "engine/mapping/lens_solver.h"

namespace veduta {

// Standard deviations of the logarithms of focal lengths, where k1, k2, all poses and all points
// are unknown, too: at the solution that SolveWithLenses has left, with the lenses as they are
// refined. One number for each lens.
//
// Errors of features side by side are not independent, so the covariance is the cluster-robust one
// over cells of the pictures, as in CovarianceInNetwork (network_covariance.h), without its
// corrections for few cells. The weights are those of Cauchy's loss. What a lens was drawn to by
// the solver counts as well. 0 for a lens that the observations do not determine, and for all where
// the poses are left open. O(observations * (track length + lenses) + cells * lenses^2), and one
// factorisation of the poses. Deterministic.
std::vector<double> LensDeviations(const BundleOptions& options, const BundleLenses& lenses,
                                   const BundleProblem& problem);

}  // namespace veduta
