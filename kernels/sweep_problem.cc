// SPDX-License-Identifier: Apache-2.0
#include "kernels/sweep_problem.h"

#include <cmath>
#include <limits>
#include <string>

namespace veduta {
namespace {

// Rows and columns of 65535 px at most: positions in fixed point stay in 32 bits.
constexpr uint32_t kSideMax = 65535;

Status CheckImage(const GrayView& image, const std::string& name) {
  if (image.width_px < 2 || image.height_px < 2 || image.width_px > kSideMax ||
      image.height_px > kSideMax || image.pixels == nullptr) {
    return Status::InvalidArgument(
        name + " is " + std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
        (image.pixels ? "" : " without pixels") + "; it must have 2 to 65535 px each way");
  }
  return Status::Ok();
}

}  // namespace

SweepPlane SweepPlane::Gap() {
  return {0, 0, std::numeric_limits<float>::quiet_NaN()};
}

Status SweepProblem::Check() const {
  VEDUTA_RETURN_IF_ERROR(CheckImage(key, "the key view"));
  if (sensors.empty() || sensors.size() > kSweepSensorsMax) {
    return Status::InvalidArgument(std::to_string(sensors.size()) +
                                   " sensor views; there must be 1 to " +
                                   std::to_string(kSweepSensorsMax));
  }
  for (size_t s = 0; s < sensors.size(); ++s) {
    VEDUTA_RETURN_IF_ERROR(CheckImage(sensors[s].image, "sensor view " + std::to_string(s)));
    bool finite = true;
    for (const float value : sensors[s].rotation) finite = finite && std::isfinite(value);
    for (const float value : sensors[s].translation) finite = finite && std::isfinite(value);
    if (!finite)
      return Status::InvalidArgument("sensor view " + std::to_string(s) +
                                     "'s geometry is not finite");
  }
  if (!base.empty() && base.size() != static_cast<size_t>(key.width_px) * key.height_px) {
    return Status::InvalidArgument("the base has " + std::to_string(base.size()) +
                                   " pixels, not the key view's");
  }
  if (planes.size() < 2 || planes.size() > kSweepPlanesMax) {
    return Status::InvalidArgument(std::to_string(planes.size()) + " planes; there must be 2 to " +
                                   std::to_string(kSweepPlanesMax));
  }
  for (const SweepPlane& plane : planes) {
    const bool finite =
        std::isfinite(plane.x) && std::isfinite(plane.y) && std::isfinite(plane.constant);
    if (!finite && !plane.is_gap()) return Status::InvalidArgument("a plane is not finite");
  }
  return Status::Ok();
}

}  // namespace veduta
