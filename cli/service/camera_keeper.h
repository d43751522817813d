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

  Engine* const engine_;
  PhotoIntake* const intake_;
  std::mutex calibrating_;
  std::jthread thread_;
};

}  // namespace veduta
