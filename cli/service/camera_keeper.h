// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calibrates the cameras of the photos that a city begins with, where nobody names one, once they
// have come.

#include <functional>
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
  // `failed` hears why a calibration that nobody has asked for failed, from the keeper's thread.
  CameraKeeper(Engine* engine, PhotoIntake* intake, std::function<void(const Status&)> failed = {});

  // Engine::CalibrateWaiting, and then puts all photos in line that wait for their cameras: where
  // no camera was found, they fit perhaps into what was placed meanwhile. Callers take turns.
  Result<std::vector<FirstCamera>> CalibrateNow(const std::stop_token& stop);

 private:
  // Calibrates whenever half as many photos again wait as the last time, and no more come; a little
  // later where that has failed.
  void Run(const std::stop_token& stop);
  // For who has `calibrating_`. What has none then is put in line where `also_without_new`.
  Result<std::vector<FirstCamera>> Calibrate(const std::stop_token& stop, bool also_without_new);
  // How many photos must wait for another calibration to be worth it, for who has `calibrating_`.
  size_t CountWanted() const;

  Engine* const engine_;
  PhotoIntake* const intake_;
  const std::function<void(const Status&)> failed_;
  std::mutex calibrating_;
  size_t tried_ = 0;  // photos that waited when no camera was found, by `calibrating_`
  std::jthread thread_;
};

}  // namespace veduta
