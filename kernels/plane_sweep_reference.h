// SPDX-License-Identifier: Apache-2.0
#pragma once
// Plane sweep and scanline optimisation in plain C++: what the OpenCL kernels are compared with,
// and what works without a device. Arguments are checked by the callers.

#include "kernels/plane_choice.h"
#include "kernels/sweep_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

void SweepPlanesReference(const SweepProblem& problem, ThreadPool& pool, CostVolume* volume);
void ChoosePlanesReference(const CostVolume& volume, const GrayView& key,
                           const ScanlineOptions& options, ThreadPool& pool, PlaneChoice* choice);

}  // namespace veduta
