// SPDX-License-Identifier: Apache-2.0
#include "kernels/plane_sweep.h"

#include "kernels/plane_sweep_device.h"
#include "kernels/plane_sweep_reference.h"

namespace veduta {

Result<CostVolume> SweepPlanes(const SweepProblem& problem, Device* device, ThreadPool& pool,
                               const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(problem.Check());
  const uint32_t plane_count = static_cast<uint32_t>(problem.planes.size());
  CostVolume volume{
      problem.key.width_px, problem.key.height_px, plane_count, PlaneStride(plane_count), {}};
  volume.costs.assign(static_cast<size_t>(volume.width_px) * volume.height_px * volume.plane_stride,
                      kCostMax);
  if (device != nullptr) {
    VEDUTA_RETURN_IF_ERROR(SweepPlanesOnDevice(problem, *device, stop, &volume));
  } else {
    VEDUTA_RETURN_IF_ERROR(SweepPlanesReference(problem, pool, stop, &volume));
  }
  return volume;
}

}  // namespace veduta
