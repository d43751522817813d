// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/calibration_result.h"

#include <algorithm>

namespace veduta {

uint32_t Calibration::UsedPhotoCount() const {
  return static_cast<uint32_t>(
      std::count_if(photos.begin(), photos.end(),
                    [](const CalibrationPhoto& photo) { return photo.why_left_out.empty(); }));
}

}  // namespace veduta
