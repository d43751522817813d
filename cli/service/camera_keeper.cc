// SPDX-License-Identifier: Apache-2.0
#include "cli/service/camera_keeper.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <utility>

#include "storage/base/memory_shortage.h"

namespace veduta {
namespace {

// Fewer photos are not calibrated by (SceneCalibrationOptions::images_min).
constexpr size_t kPhotosMin = 4;
// Who sends photos has sent all of them when no other one comes for so long. Chosen by hand.
constexpr std::chrono::seconds kQuiet(10);
// Before another attempt where the disk or the memory has failed. Chosen by hand.
constexpr std::chrono::seconds kPause(5);

void Pause(const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, stop, kPause, [] { return false; });
}

bool IsAnyKnown(const Result<std::vector<FirstCamera>>& cameras) {
  return cameras.ok() &&
         std::ranges::any_of(*cameras, [](const auto& c) { return !c.name.empty(); });
}

}  // namespace

CameraKeeper::CameraKeeper(Engine* engine, PhotoIntake* intake,
                           std::function<void(const Status&)> failed)
    : engine_(engine),
      intake_(intake),
      failed_(std::move(failed)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

Result<std::vector<FirstCamera>> CameraKeeper::CalibrateNow(const std::stop_token& stop) {
  const std::lock_guard lock(calibrating_);
  return Calibrate(stop, true);
}

size_t CameraKeeper::CountWanted() const {
  return std::max(kPhotosMin, tried_ + (tried_ + 1) / 2);
}

Result<std::vector<FirstCamera>> CameraKeeper::Calibrate(const std::stop_token& stop,
                                                         bool also_without_new) {
  const size_t count = intake_->counts().awaiting_camera;
  auto cameras =
      CatchShortage("calibrate cameras", [&] { return engine_->CalibrateWaiting(stop); });
  if (cameras.ok()) tried_ = IsAnyKnown(cameras) ? 0 : count;
  if (cameras.ok() && (also_without_new || tried_ == 0))
    VEDUTA_RETURN_IF_ERROR(intake_->Resume(engine_, true));
  return cameras;
}

void CameraKeeper::Run(const std::stop_token& stop) {
  for (;;) {
    size_t wanted = 0;
    {
      const std::lock_guard lock(calibrating_);
      wanted = CountWanted();
    }
    if (intake_->AwaitCameraless(wanted, kQuiet, stop) == 0) return;
    Status failed;
    {
      const std::lock_guard lock(calibrating_);
      // Somebody may have had it done meanwhile.
      if (intake_->counts().awaiting_camera < CountWanted()) continue;
      failed = Calibrate(stop, false).status();
    }
    if (failed.ok()) continue;
    if (failed_) failed_(failed);
    Pause(stop);
  }
}

}  // namespace veduta
