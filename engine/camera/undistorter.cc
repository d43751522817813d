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
// What a table costs besides its pixels (list, map and headers), so that tiny tables are bounded in
// number too. Chosen by hand; not measured.
constexpr size_t kOverheadBytes = 512;
constexpr int kStepsPerPixel = cv::INTER_TAB_SIZE;  // 32
static_assert(kStepsPerPixel == 32 && cv::INTER_BITS == 5);

// Rounds a position to 1/32 px. Positions outside of the photo are pulled to where all four
// neighbours still are outside, which keeps them within 16 bits.
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
    return Status::NoMemory(std::string("there is not enough memory to undistort the photo: ") +
                            e.what());
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
    return Status::NoMemory(std::string("there is not enough memory to undistort the photo: ") +
                            e.what());
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
  // Also keeps numbers that do not equal themselves out of the maps.
  VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
  std::shared_ptr<Build> build;
  {
    std::unique_lock lock(mutex_);
    if (TablePtr kept = tables_.Find(model)) {
      ++hit_count_;
      return kept;
    }
    if (const auto found = builds_.find(model); found != builds_.end()) {
      ++hit_count_;
      build = found->second;
      built_.wait(lock, [&] { return build->result.has_value(); });
      return *build->result;
    }
    ++build_count_;
    build = std::make_shared<Build>();
    builds_.emplace(model, build);
  }
  // Build catches its exceptions, so that nobody waits for ever.
  Result<TablePtr> table = UndistortTable::Build(model);
  {
    const std::lock_guard lock(mutex_);
    if (table.ok()) {
      const size_t cost = table.value()->size_bytes() + kOverheadBytes;
      if (cost <= size_bytes_max_) tables_.Put(model, table.value(), cost);
    }
    build->result = table;
    builds_.erase(model);
  }
  built_.notify_all();
  return table;
}

UndistortCache::Stats UndistortCache::stats() const {
  const std::lock_guard lock(mutex_);
  return {hit_count_, build_count_, tables_.size(), tables_.cost()};
}

}  // namespace veduta
