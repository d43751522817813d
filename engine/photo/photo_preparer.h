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

#include "engine/camera/decoder.h"
#include "engine/camera/photo_decoder.h"
#include "engine/camera/undistorter.h"
#include "engine/door/submission.h"
#include "engine/features/extractor.h"
#include "engine/photo/memory_budget.h"
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
  // >= 1, bytes that photos may take at once while they are decoded and their features extracted. A
  // photo that needs more is prepared alone. It decides when a photo is prepared and never what
  // becomes of it.
  uint64_t memory_bytes = DefaultPrepareMemoryBytes(UsableMemoryBytes(), 0);

  // The first violated bound, named with its value.
  Status Check() const;
};

// What preparing a photo takes at most, by its file's size and its pixels: decoding takes up to 16
// bytes for each pixel (DecodeLimits); extraction takes ExtractionBytes besides 5 bytes for each
// pixel as it was decoded, grey and straightened. Counted from the buffers; not measured.
uint64_t PrepareBytes(uint64_t size_bytes, uint64_t pixel_count);

// Of a photo whose pose is to come with others (Engine::Import): it is stored and compared with
// others, and not placed. Besides those that look like it, it is compared with these photos of the
// same contributor, as far as they are stored.
struct AwaitedPose {
  std::vector<std::string> seen_with;  // their names
};

struct PreparedPhoto {
  std::string name;
  ContentHash hash;
  uint64_t size_bytes = 0;
  uint32_t width_px = 0, height_px = 0;
  uint8_t orientation = 0;  // as ImageRecord has it
  std::optional<GpsFix> gps;
  std::optional<TakenTime> taken;
  std::string media_type;
  uint32_t contribution = 0;  // that it comes with; 0: with none
  std::optional<AwaitedPose> awaited = {};
  // What came, where these are not its bytes: it is sealed.
  std::shared_ptr<const std::vector<uint8_t>> original = {};
  Reason reason = Reason::kNone;  // not kNone: rejected, and why
  std::string detail;
  // Why the photo could not be prepared, where this says nothing about the photo: its file cannot
  // be read, or the memory is too short. There is no verdict, and it may be sent again.
  Status failure;
  bool known = false;  // these bytes were in the database already; not decoded
  Features features;
  WrittenAhead written_ahead;  // gives photo and features up unless they are committed
  double decode_ms = 0, undistort_ms = 0, features_ms = 0;
};

// What a photo tells without being decoded.
struct PhotoFacts {
  ContentHash hash;
  std::string camera_group;                // CameraGroupOf
  std::optional<double> focal_share = {};  // FocalShareOf
  std::string shape;  // size and orientation, the same for photos of one camera that was not
                      // turned; empty where the file is not a photo
  bool is_upside_down = false;  // its pixels are stored half round (EXIF's orientation 3)
};

// The database, the tables and the decoder must outlive it. Thread-safe; a call waits while photos
// of others take the memory that its photo needs.
class PhotoPreparer final {
 public:
  PhotoPreparer(Database* database, UndistortCache* tables, PrepareOptions options,
                const PhotoDecoder& decoder = DecoderInProcess())
      : database_(database),
        tables_(tables),
        decoder_(decoder),
        options_(std::move(options)),
        budget_(options_.memory_bytes) {}

  // Whether others may be prepared meanwhile. Alone is for a second attempt where the first one's
  // memory was too short.
  enum class Company : uint8_t { kOthers, kAlone };

  // Also writes photo and features ahead of the commit, unless the photo is rejected or known. An
  // error means that the database failed; whatever is wrong with the photo is in its `reason`, and
  // whatever kept it from being judged in its `failure`.
  Result<PreparedPhoto> Prepare(const PhotoSource& source, const CameraModel& camera,
                                const std::string& contributor,
                                Company company = Company::kOthers) const;
  // Reads the photo and decodes nothing. Where the file is too large there is no hash. kIoError,
  // kNotFound, kNoMemory.
  Result<PhotoFacts> Look(const PhotoSource& source) const;
  // The photo upright, of any size. As Prepare, it waits for the memory that decoding takes.
  DecodedPhoto Decode(std::span<const uint8_t> bytes) const;
  // What Prepare does without the database, for queries by a photo that is not added. Without a
  // camera the photo is taken for one without distortion, of any size. `preferred` of a photo that
  // is stored: StoredLayout.
  PreparedPhoto Extract(const PhotoSource& source, const std::optional<CameraModel>& camera,
                        PhotoLayout preferred = PhotoLayout::kAsStored) const;
  const PhotoDecoder& decoder() const { return decoder_; }
  UndistortCache& tables() const { return *tables_; }
  // Waits for bytes of the memory that photos are prepared with, for what else takes much for a
  // while. Whoever holds some must not wait for a photo to be prepared.
  MemoryBudget::Share TakeMemory(uint64_t bytes) const;

 private:
  // The photo's bytes: those of its source, or read into `own`, with the hash and the size noted in
  // `photo`; none where they cannot be had, with the reason or the failure noted.
  std::optional<std::span<const uint8_t>> ReadBytes(const PhotoSource& source,
                                                    std::vector<uint8_t>* own,
                                                    PreparedPhoto* photo) const;
  // PrepareBytes, and what handing the photo to the decoder takes.
  uint64_t NeededBytes(uint64_t size_bytes, uint64_t pixel_count) const;
  void ExtractBytes(std::span<const uint8_t> bytes, const PhotoHeader& header,
                    const std::optional<CameraModel>& camera, PhotoLayout preferred,
                    PreparedPhoto* photo) const;

  Result<PreparedPhoto> PrepareWithin(const PhotoSource& source, const CameraModel& camera,
                                      const std::string& contributor) const;
  // Extracts with the memory of an earlier extraction, where one has left some.
  Result<Features> ExtractFeaturesOf(const cv::Mat& gray) const;
  void DropIdleScratch() const;

  Database* database_;
  UndistortCache* tables_;
  const PhotoDecoder& decoder_;
  const PrepareOptions options_;
  mutable MemoryBudget budget_;
  mutable std::mutex mutex_;  // of idle_scratch_
  struct IdleScratch {
    std::unique_ptr<FeatureScratch> scratch;
    uint64_t size_bytes = 0;
    MemoryBudget::Share share;
  };
  mutable std::vector<IdleScratch> idle_scratch_;
};

}  // namespace veduta
