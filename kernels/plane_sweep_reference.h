// SPDX-License-Identifier: Apache-2.0
#pragma once
// Plane sweep and scanline optimisation in plain C++: what the OpenCL kernels are compared with,
// and what works without a device. Arguments are checked by the callers.

#include <stop_token>

#include "kernels/plane_choice.h"
#include "kernels/sweep_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Both: kCancelled after a stop request.
Status SweepPlanesReference(const SweepProblem& problem, ThreadPool& pool,
                            const std::stop_token& stop, CostVolume* volume);
Status ChoosePlanesReference(const CostVolume& volume, const GrayView& key,
                             const ScanlineOptions& options, ThreadPool& pool,
                             const std::stop_token& stop, PlaneChoice* choice);

}  // namespace veduta
