// SPDX-License-Identifier: Apache-2.0
#include "cli/service/camera_keeper.h"

#include <algorithm>
#include <chrono>

#include "storage/base/memory_shortage.h"

namespace veduta {
namespace {

// Fewer photos are not calibrated by (SceneCalibrationOptions::images_min).
constexpr size_t kPhotosMin = 4;
// Who sends photos has sent all of them when no other one comes for so long. Chosen by hand.
constexpr std::chrono::seconds kQuiet(10);

bool IsAnyKnown(const Result<std::vector<FirstCamera>>& cameras) {
  return cameras.ok() &&
         std::ranges::any_of(*cameras, [](const auto& c) { return !c.name.empty(); });
}

}  // namespace

CameraKeeper::CameraKeeper(Engine* engine, PhotoIntake* intake)
    : engine_(engine),
      intake_(intake),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

Result<std::vector<FirstCamera>> CameraKeeper::CalibrateNow(const std::stop_token& stop) {
  const std::lock_guard lock(calibrating_);
  auto cameras =
      CatchShortage("calibrate cameras", [&] { return engine_->CalibrateWaiting(stop); });
  if (cameras.ok()) VEDUTA_RETURN_IF_ERROR(intake_->Resume(engine_, true));
  return cameras;
}

void CameraKeeper::Run(const std::stop_token& stop) {
  for (size_t tried = 0;;) {
    const size_t count =
        intake_->AwaitCameraless(std::max(kPhotosMin, tried + (tried + 1) / 2), kQuiet, stop);
    if (count == 0) return;
    const std::lock_guard lock(calibrating_);
    const auto cameras =
        CatchShortage("calibrate cameras", [&] { return engine_->CalibrateWaiting(stop); });
    tried = IsAnyKnown(cameras) ? 0 : count;
    if (tried == 0)
      intake_->Resume(engine_, true).IgnoreBecause("it is tried again after the next pause");
  }
}

}  // namespace veduta
