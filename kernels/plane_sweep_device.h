// SPDX-License-Identifier: Apache-2.0
#pragma once
// Plane sweep and scanline optimisation on an OpenCL device. Arguments are checked by the callers.

#include "kernels/device.h"
#include "kernels/plane_choice.h"
#include "kernels/sweep_problem.h"

namespace veduta {

Status SweepPlanesOnDevice(const SweepProblem& problem, Device& device, CostVolume* volume);
Status ChoosePlanesOnDevice(const CostVolume& volume, const GrayView& key,
                            const ScanlineOptions& options, Device& device, PlaneChoice* choice);
Status SweepAndChooseOnDevice(const SweepProblem& problem, const ScanlineOptions& options,
                              Device& device, PlaneChoice* choice);

}  // namespace veduta
