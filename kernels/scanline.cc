// SPDX-License-Identifier: Apache-2.0
#include "kernels/scanline.h"

#include <string>

#include "kernels/plane_sweep.h"
#include "kernels/plane_sweep_device.h"
#include "kernels/plane_sweep_reference.h"

namespace veduta {
namespace {

PlaneChoice EmptyChoice(size_t pixels) {
  PlaneChoice choice;
  for (auto* values : {&choice.plane, &choice.cost_before, &choice.cost, &choice.cost_after,
                       &choice.cost_second}) {
    values->resize(pixels);
  }
  return choice;
}

Status CheckVolume(const CostVolume& volume, const GrayView& key) {
  const size_t pixels = static_cast<size_t>(volume.width_px) * volume.height_px;
  if (volume.width_px != key.width_px || volume.height_px != key.height_px || pixels == 0 ||
      key.pixels == nullptr) {
    return Status::InvalidArgument("the volume is not of the key view's size");
  }
  if (volume.plane_count == 0 || volume.plane_count > kSweepPlanesMax ||
      volume.plane_stride != PlaneStride(volume.plane_count) ||
      volume.costs.size() != pixels * volume.plane_stride) {
    return Status::InvalidArgument("the volume's " + std::to_string(volume.costs.size()) +
                                   " costs are not " + std::to_string(volume.plane_count) +
                                   " planes of " + std::to_string(pixels) +
                                   " pixels, padded to blocks of " + std::to_string(kPlaneBlock));
  }
  for (const uint8_t cost : volume.costs) {
    if (cost > kCostMax)
      return Status::InvalidArgument("a cost is " + std::to_string(cost) + ", over 127");
  }
  return Status::Ok();
}

}  // namespace

Result<PlaneChoice> ChoosePlanes(const CostVolume& volume, const GrayView& key,
                                 const ScanlineOptions& options, Device* device, ThreadPool& pool,
                                 const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckVolume(volume, key));
  PlaneChoice choice = EmptyChoice(static_cast<size_t>(volume.width_px) * volume.height_px);
  if (device != nullptr) {
    VEDUTA_RETURN_IF_ERROR(ChoosePlanesOnDevice(volume, key, options, *device, stop, &choice));
  } else {
    VEDUTA_RETURN_IF_ERROR(ChoosePlanesReference(volume, key, options, pool, stop, &choice));
  }
  return choice;
}

Result<PlaneChoice> SweepAndChoose(const SweepProblem& problem, const ScanlineOptions& options,
                                   Device* device, ThreadPool& pool, const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(problem.Check());
  PlaneChoice choice =
      EmptyChoice(static_cast<size_t>(problem.key.width_px) * problem.key.height_px);
  if (device != nullptr) {
    VEDUTA_RETURN_IF_ERROR(SweepAndChooseOnDevice(problem, options, *device, stop, &choice));
    return choice;
  }
  VEDUTA_ASSIGN_OR_RETURN(const CostVolume volume, SweepPlanes(problem, nullptr, pool, stop));
  VEDUTA_RETURN_IF_ERROR(ChoosePlanesReference(volume, problem.key, options, pool, stop, &choice));
  return choice;
}

}  // namespace veduta
