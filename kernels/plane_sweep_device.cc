// SPDX-License-Identifier: Apache-2.0
#include "kernels/plane_sweep_device.h"
namespace veduta {
Status SweepPlanesOnDevice(const SweepProblem& problem, Device& device, CostVolume* volume) { return Status::IoError("todo"); }
Status ChoosePlanesOnDevice(const CostVolume& volume, const GrayView& key, const ScanlineOptions& options,
                            Device& device, PlaneChoice* choice) { return Status::IoError("todo"); }
Status SweepAndChooseOnDevice(const SweepProblem& problem, const ScanlineOptions& options, Device& device,
                              PlaneChoice* choice) { return Status::IoError("todo"); }
}
