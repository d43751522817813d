// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration of a session of known truth, for tests of what is written about it.

#include "engine/camera/calibration/calibrator.h"
#include "tools/calibration/synthetic_session.h"

namespace veduta::testing {

// Of 8 photos. The third one's name would do harm in HTML.
inline const Calibration& SampleCalibration() {
  static const Calibration made = [] {
    SyntheticSession session = MakeSession({.photo_count = 8, .seed = 21});
    session.input.views[2].name = "<script>\"&.jpg";
    return *CalibrateCamera(session.input);
  }();
  return made;
}

}  // namespace veduta::testing
