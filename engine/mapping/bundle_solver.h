// SPDX-License-Identifier: Apache-2.0
#pragma once
// Levenberg-Marquardt on poses and points, the points eliminated first (Schur complement). Method:
// Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000; the radius of trust as Nielsen's,
// 1999.

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/bundle_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Refines the free poses and all points; the problem holds the best found. Cauchy loss by
// reweighting. Points are worked on in pieces over the pool (null: on the caller alone), whose sums
// are joined in one order: the same bits with any number of threads. Not usable if the first cost
// is not finite.
BundleSolution SolveBundle(const BundleOptions& options, ThreadPool* pool, BundleProblem* problem);

}  // namespace veduta
