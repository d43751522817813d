// SPDX-License-Identifier: Apache-2.0
#pragma once
// Levenberg-Marquardt on poses and points, the points eliminated first (Schur complement). Method:
// Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000; the radius of trust as Nielsen's,
// 1999.

#include "engine/mapping/bundle_options.h"
#include "engine/mapping/bundle_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Refines the free poses and all points; the problem then holds the best that was found. The Cauchy
// loss is applied by reweighting. The points are worked on in pieces, side by side over `pool`
// (null: on the caller's thread alone), and the sums of the pieces are joined in one order: the
// same bits with any number of threads. The solution is not usable if the first cost is not finite.
BundleSolution SolveBundle(const BundleOptions& options, ThreadPool* pool, BundleProblem* problem);

}  // namespace veduta
