// SPDX-License-Identifier: Apache-2.0
#pragma once
// Plane sweep and scanline optimisation on an OpenCL device. Arguments are checked by the callers.

#include <stop_token>

#include "kernels/device.h"
#include "kernels/plane_choice.h"
#include "kernels/sweep_problem.h"

namespace veduta {

// All: kCancelled after a stop request.
Status SweepPlanesOnDevice(const SweepProblem& problem, Device& device, const std::stop_token& stop,
                           CostVolume* volume);
Status ChoosePlanesOnDevice(const CostVolume& volume, const GrayView& key,
                            const ScanlineOptions& options, Device& device,
                            const std::stop_token& stop, PlaneChoice* choice);
Status SweepAndChooseOnDevice(const SweepProblem& problem, const ScanlineOptions& options,
                              Device& device, const std::stop_token& stop, PlaneChoice* choice);

}  // namespace veduta
