// SPDX-License-Identifier: Apache-2.0
#pragma once
// The part of adding a photo that depends on the photo alone: it is read, decoded and undistorted,
// and its features are extracted. This runs on all cores, ahead of the photos' turns.

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
#include "storage/written_ahead.h"

namespace veduta {

struct PrepareOptions {
  DecodeLimits limits;
  FeatureOptions features;
  // >= 1. A photo with fewer features is rejected: there is nothing to recognise it by. Chosen by
  // hand; not measured.
  uint32_t feature_count_min = 60;
  // >= 0, px. Features so near to where the undistorted photo ends are dropped: the artificial
  // border has corners of its own. Chosen by hand; not measured.
  double border_px = 4;

  // The first violated bound, named with its value.
  Status Check() const;
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
  WrittenAhead written_ahead;  // gives photo and features up unless they are committed
  double decode_ms = 0, undistort_ms = 0, features_ms = 0;
};

// The database and the tables must outlive it. Thread-safe.
class PhotoPreparer final {
 public:
  PhotoPreparer(Database* database, UndistortCache* tables, PrepareOptions options)
      : database_(database), tables_(tables), options_(std::move(options)) {}

  // Also writes photo and features ahead of the commit, unless the photo is rejected or known. An
  // error means that the database failed; whatever is wrong with the photo is in its `reason`.
  Result<PreparedPhoto> Prepare(const PhotoSource& source, const CameraModel& camera) const;
  // The same without the database, for queries by a photo that is not added. Without a camera the
  // photo is taken for one without distortion, of any size.
  PreparedPhoto Extract(const PhotoSource& source, const std::optional<CameraModel>& camera) const;

 private:
  Result<std::vector<uint8_t>> ReadFile(const std::string& path) const;
  // The photo's bytes, with the hash and the size noted in `photo`; empty where they cannot be had,
  // with the reason noted.
  std::optional<std::vector<uint8_t>> ReadBytes(const PhotoSource& source,
                                                PreparedPhoto* photo) const;
  void ExtractBytes(std::span<const uint8_t> bytes, const std::optional<CameraModel>& camera,
                    PreparedPhoto* photo) const;

  // Extracts with the memory of an earlier extraction, where one has left some.
  Result<Features> ExtractFeaturesOf(const cv::Mat& gray) const;

  Database* database_;
  UndistortCache* tables_;
  const PrepareOptions options_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<FeatureScratch>> idle_scratch_;
};

}  // namespace veduta
