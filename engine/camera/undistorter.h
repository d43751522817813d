// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos without their lens: look-up tables from undistorted to distorted pixels, and a cache of
// them.
//
// The undistorted image is a pinhole image with the photo's size and fx, fy, cx, cy. Where it looks
// past the photo's edge it is black, and along that border a pixel is blended with black;
// IsInsidePhoto (projection.h) tells which pixels lie inside.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <unordered_map>

#include "storage/base/lru_cache.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

// The table of one camera: 6 bytes for each pixel. Immutable, so one table serves any number of
// threads.
class UndistortTable final {
 public:
  // Computes the distortion of each pixel in double precision, about 8 ns each. kInvalidArgument if
  // CheckCamera refuses the model or a side exceeds 32766 px (positions are 16-bit numbers).
  static Result<std::shared_ptr<const UndistortTable>> Build(const CameraModel& model);

  // Bilinear, with positions rounded to 1/32 px and integer arithmetic: the same bytes on every
  // processor and with any number of OpenCV's threads. `photo`: 8 bits, 1 to 4 channels, the
  // camera's size; kInvalidArgument otherwise.
  Result<cv::Mat> Apply(const cv::Mat& photo) const;

  const CameraModel& model() const { return model_; }
  size_t size_bytes() const {
    return whole_px_.total() * whole_px_.elemSize() + fraction_.total() * fraction_.elemSize();
  }

 private:
  UndistortTable() = default;

  CameraModel model_;
  cv::Mat whole_px_;  // CV_16SC2: x, y of the pixel up and left of the position
  // CV_16UC1: 32 * (y in 1/32 px) + (x in 1/32 px), the index into OpenCV's table of weights.
  cv::Mat fraction_;
};

// Least recently used tables are dropped once all of them together exceed the bound. Thread-safe:
// threads that want the same missing table wait for the one that builds it, and nobody else waits.
class UndistortCache final {
 public:
  struct Stats {
    uint64_t hit_count = 0;  // served from the cache, or by waiting for another thread's build
    uint64_t build_count = 0;
    size_t table_count = 0;
    size_t size_bytes = 0;  // of all tables held, with 512 bytes of bookkeeping for each
  };

  // A table that alone exceeds `size_bytes_max` is built each time and never kept.
  explicit UndistortCache(size_t size_bytes_max)
      : size_bytes_max_(size_bytes_max), tables_(size_bytes_max) {}
  UndistortCache(const UndistortCache&) = delete;
  UndistortCache& operator=(const UndistortCache&) = delete;

  // The undistorted image of a photo; the photo itself, not a copy, if the camera has no
  // distortion. The errors are those of UndistortTable's Build and Apply.
  Result<cv::Mat> Undistort(const CameraModel& model, const cv::Mat& photo);

  // The camera's table, found or built. It outlives its place in the cache.
  Result<std::shared_ptr<const UndistortTable>> Table(const CameraModel& model);

  Stats stats() const;

 private:
  using TablePtr = std::shared_ptr<const UndistortTable>;
  // One table under construction, shared by the threads that wait for it.
  struct Build {
    std::optional<Result<TablePtr>> result;  // set once the build has ended
  };
  struct ModelHash {
    size_t operator()(const CameraModel& model) const;
  };

  const size_t size_bytes_max_;
  LruCache<CameraModel, TablePtr, ModelHash> tables_;
  // Guards what follows. It is held while a table goes from builds_ to tables_, so that no thread
  // misses it in both.
  mutable std::mutex mutex_;
  std::condition_variable built_;
  std::unordered_map<CameraModel, std::shared_ptr<Build>, ModelHash> builds_;
  uint64_t hit_count_ = 0, build_count_ = 0;
};

}  // namespace veduta
