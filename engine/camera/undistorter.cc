// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/undistorter.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr uint32_t kTableSideMax = 32766;  // cv::remap wants less than SHRT_MAX
constexpr size_t kSlotOverheadBytes =
    512;  // list, map and headers, so that tiny tables are bounded in number too
constexpr int kStepsPerPixel = cv::INTER_TAB_SIZE;  // 32
static_assert(kStepsPerPixel == 32 && cv::INTER_BITS == 5);

// Rounds a position to 1/32 px. Positions outside are pulled to where all four neighbours still are
// outside, which keeps them within 16 bits.
int Steps(double position_px, double side_px) {
  return static_cast<int>(
      std::lrint(std::clamp(position_px, -2.0, side_px + 1.0) * kStepsPerPixel));
}

Status CheckPhoto(const CameraModel& model, const cv::Mat& photo) {
  if (photo.dims == 2 && photo.depth() == CV_8U && photo.channels() <= 4 && photo.cols > 0 &&
      photo.rows > 0 && static_cast<uint32_t>(photo.cols) == model.width_px &&
      static_cast<uint32_t>(photo.rows) == model.height_px) {
    return Status::Ok();
  }
  return Status::InvalidArgument(
      "a photo of " + std::to_string(photo.cols) + "x" + std::to_string(photo.rows) + " px and " +
      std::to_string(8 * photo.elemSize1()) + " bits is not one of this camera's, which have " +
      std::to_string(model.width_px) + "x" + std::to_string(model.height_px) + " px of 8 bits");
}

}  // namespace

Result<std::shared_ptr<const UndistortTable>> UndistortTable::Build(const CameraModel& model) {
  VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
  if (std::max(model.width_px, model.height_px) > kTableSideMax) {
    return Status::InvalidArgument("photos of " + std::to_string(model.width_px) + "x" +
                                   std::to_string(model.height_px) +
                                   " px cannot be undistorted: a side exceeds 32766 px");
  }
  try {
    std::shared_ptr<UndistortTable> table(new UndistortTable);
    table->model_ = model;
    const int width = static_cast<int>(model.width_px);
    const int height = static_cast<int>(model.height_px);
    table->whole_px_.create(height, width, CV_16SC2);
    table->fraction_.create(height, width, CV_16UC1);
    for (int v = 0; v < height; ++v) {
      auto* whole_px = table->whole_px_.ptr<cv::Vec2s>(v);
      auto* fraction = table->fraction_.ptr<uint16_t>(v);
      for (int u = 0; u < width; ++u) {
        const Eigen::Vector2d in_photo = DistortPixel(model, {u, v});
        const int x = Steps(in_photo.x(), width);
        const int y = Steps(in_photo.y(), height);
        whole_px[u] = cv::Vec2s(static_cast<int16_t>(x >> cv::INTER_BITS),
                                static_cast<int16_t>(y >> cv::INTER_BITS));
        fraction[u] = static_cast<uint16_t>((y & (kStepsPerPixel - 1)) * kStepsPerPixel +
                                            (x & (kStepsPerPixel - 1)));
      }
    }
    return std::shared_ptr<const UndistortTable>(std::move(table));
  } catch (const std::exception& e) {  // memory
    return Status::IoError(std::string("no memory for a table of undistortion: ") + e.what());
  }
}

Result<cv::Mat> UndistortTable::Apply(const cv::Mat& photo) const {
  VEDUTA_RETURN_IF_ERROR(CheckPhoto(model_, photo));
  try {
    cv::Mat undistorted;
    cv::remap(photo, undistorted, whole_px_, fraction_, cv::INTER_LINEAR, cv::BORDER_CONSTANT,
              cv::Scalar::all(0));
    return undistorted;
  } catch (const std::exception& e) {
    return Status::IoError(std::string("undistortion failed: ") + e.what());
  }
}

size_t UndistortCache::ModelHash::operator()(const CameraModel& model) const {
  uint64_t hash = MixSeed(model.width_px, model.height_px);
  for (const double value :
       {model.fx, model.fy, model.cx, model.cy, model.k1, model.k2, model.u0, model.v0}) {
    hash = MixSeed(hash, std::hash<double>()(value));  // equal for 0 and -0, which compare equal
  }
  return hash;
}

Result<cv::Mat> UndistortCache::Undistort(const CameraModel& model, const cv::Mat& photo) {
  if (!IsDistorted(model)) {
    VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
    VEDUTA_RETURN_IF_ERROR(CheckPhoto(model, photo));
    return photo;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const UndistortTable> table, Table(model));
  return table->Apply(photo);
}

Result<std::shared_ptr<const UndistortTable>> UndistortCache::Table(const CameraModel& model) {
  VEDUTA_RETURN_IF_ERROR(
      CheckCamera(model));  // also keeps numbers that do not equal themselves out of the map
  std::shared_ptr<Slot> slot;
  {
    std::unique_lock lock(mutex_);
    if (const auto found = slot_of_.find(model); found != slot_of_.end()) {
      ++stats_.hit_count;
      slots_.splice(slots_.begin(), slots_, found->second);
      slot = *found->second;
      built_.wait(lock, [&] { return slot->is_built; });
      if (!slot->failure.ok()) return slot->failure;
      return slot->table;
    }
    ++stats_.build_count;
    slot = std::make_shared<Slot>();
    slot->model = model;
    slots_.push_front(slot);
    slot_of_.emplace(model, slots_.begin());
  }
  auto built =
      UndistortTable::Build(model);  // catches its exceptions: a slot never stays unfinished
  {
    const std::lock_guard lock(mutex_);
    FinishLocked(slot, built);
  }
  built_.notify_all();
  return built;
}

void UndistortCache::FinishLocked(const std::shared_ptr<Slot>& slot,
                                  Result<std::shared_ptr<const UndistortTable>> built) {
  slot->is_built = true;
  if (!built.ok()) {
    slot->failure = built.status();
    const auto found = slot_of_.find(slot->model);
    slots_.erase(found->second);
    slot_of_.erase(found);
    return;
  }
  slot->table = std::move(built).value();
  stats_.size_bytes += slot->table->size_bytes() + kSlotOverheadBytes;
  EvictLocked();
}

void UndistortCache::EvictLocked() {
  for (auto last = slots_.end(); stats_.size_bytes > size_bytes_max_ && last != slots_.begin();) {
    --last;
    if (!(*last)->is_built) continue;  // somebody waits for it, and it holds no bytes yet
    stats_.size_bytes -= (*last)->table->size_bytes() + kSlotOverheadBytes;
    slot_of_.erase((*last)->model);
    last = slots_.erase(last);
  }
}

UndistortCache::Stats UndistortCache::stats() const {
  const std::lock_guard lock(mutex_);
  Stats stats = stats_;
  stats.table_count = static_cast<size_t>(
      std::count_if(slots_.begin(), slots_.end(),
                    [](const std::shared_ptr<Slot>& slot) { return slot->is_built; }));
  return stats;
}

}  // namespace veduta
