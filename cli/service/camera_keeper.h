// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibrates the cameras of the photos that a city begins with, where nobody names one, once they
// have come.

#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "cli/service/photo_intake.h"
#include "engine/engine.h"

namespace veduta {

// Thread-safe. Engine and intake must outlive it.
class CameraKeeper final {
 public:
  CameraKeeper(Engine* engine, PhotoIntake* intake);

  // Engine::CalibrateWaiting, and then puts all photos in line that wait for their cameras: where
  // no camera was found, they fit perhaps into what was placed meanwhile. Callers take turns.
  Result<std::vector<FirstCamera>> CalibrateNow(const std::stop_token& stop);

 private:
  // Calibrates whenever half as many photos again wait as the last time, and no more come.
  void Run(const std::stop_token& stop);
  // For who has `calibrating_`. What has none then is put in line where `also_without_new`.
  Result<std::vector<FirstCamera>> Calibrate(const std::stop_token& stop, bool also_without_new);
  // How many photos must wait for another calibration to be worth it, for who has `calibrating_`.
  size_t CountWanted() const;

  Engine* const engine_;
  PhotoIntake* const intake_;
  std::mutex calibrating_;
  size_t tried_ = 0;  // photos that waited when no camera was found, by `calibrating_`
  std::jthread thread_;
};

}  // namespace veduta
