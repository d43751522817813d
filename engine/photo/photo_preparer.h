// SPDX-License-Identifier: Apache-2.0
#pragma once
// The part of adding a photo that depends on the photo alone: read, decode, undistort, features.
// Runs ahead on all cores.

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/camera/photo_decoder.h"
#include "engine/camera/undistorter.h"
#include "engine/door/submission.h"
#include "engine/features/extractor.h"
#include "storage/database.h"

namespace veduta {

struct PrepareOptions {
  Status Check() const { return Status::Ok(); }
  DecodeLimits limits;
  FeatureOptions features;
  uint32_t feature_count_min = 60;  // fewer: nothing to recognise the photo by, it is rejected
  double border_px = 4;  // >= 0: features so near to where the undistorted photo ends are dropped
};

struct PreparedPhoto {
  std::string name;
  ContentHash hash;
  uint64_t size_bytes = 0;
  uint32_t width_px = 0, height_px = 0;
  Reason reason = Reason::kNone;  // not kNone: rejected, and why
  std::string detail;
  bool known = false;  // these bytes were in the database already; not decoded
  Features features;
  double decode_ms = 0, undistort_ms = 0, features_ms = 0;
};

// Thread-safe.
class PhotoPreparer final {
 public:
  PhotoPreparer(Database* database, UndistortCache* tables, PrepareOptions options)
      : database_(database), tables_(tables), options_(std::move(options)) {}

  // Also writes photo and features ahead of the commit, unless the photo is rejected or known. Only
  // a failing database is an error; whatever is wrong with the photo is its reason.
  Result<PreparedPhoto> Prepare(const PhotoSource& source, const CameraModel& camera) const;
  // The same without touching the database: for queries by a photo that is not added.
  PreparedPhoto Extract(const PhotoSource& source, const std::optional<CameraModel>& camera) const;

 private:
  Result<std::vector<uint8_t>> ReadBytes(const PhotoSource& source) const;
  void ExtractBytes(std::span<const uint8_t> bytes, const std::optional<CameraModel>& camera,
                    PreparedPhoto* photo) const;

  // Extracts with memory of an earlier extraction, where one has left it.
  Result<Features> ExtractFeaturesOf(const cv::Mat& gray) const;

  Database* database_;
  UndistortCache* tables_;
  const PrepareOptions options_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<FeatureScratch>> idle_scratch_;
};

}  // namespace veduta
