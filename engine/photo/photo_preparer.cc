// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_preparer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "engine/camera/projection.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

constexpr size_t kScratchPixelsMax = 16 << 20;  // memory of larger photos is given back

Reason ReasonOf(DecodeOutcome outcome) {
  switch (outcome) {
    case DecodeOutcome::kDecoded:
      return Reason::kNone;
    case DecodeOutcome::kEmpty:
      return Reason::kEmptyFile;
    case DecodeOutcome::kUnsupportedFormat:
      return Reason::kUnsupportedFormat;
    case DecodeOutcome::kUnreadable:
      return Reason::kUnreadable;
    case DecodeOutcome::kTooLarge:
      return Reason::kTooLarge;
    case DecodeOutcome::kWrongSize:
      return Reason::kWrongSize;
  }
  return Reason::kUnreadable;
}

// Drops features on the artificial border of the undistorted photo; the order stays.
void DropBorder(const CameraModel& camera, double border_px, Features* features) {
  size_t kept = 0;
  for (size_t i = 0; i < features->size(); ++i) {
    const Keypoint& k = features->keypoints[i];
    if (!IsInsidePhoto(camera, {k.x_px, k.y_px}, border_px)) continue;
    features->keypoints[kept] = k;
    std::copy_n(features->descriptor(i), kDescriptorSize,
                features->descriptors.begin() + kept * kDescriptorSize);
    ++kept;
  }
  features->keypoints.resize(kept);
  features->descriptors.resize(kept * kDescriptorSize);
}

// Colours come from the photo as it was taken: `camera` tells where each feature lies there; null:
// where it is.
void ColorFeatures(const cv::Mat& bgr, const CameraModel* camera, Features* features) {
  for (Keypoint& k : features->keypoints) {
    const Eigen::Vector2d seen =
        camera ? DistortPixel(*camera, {k.x_px, k.y_px}) : Eigen::Vector2d(k.x_px, k.y_px);
    const int x = std::clamp(static_cast<int>(std::lround(seen.x())), 0, bgr.cols - 1);
    const int y = std::clamp(static_cast<int>(std::lround(seen.y())), 0, bgr.rows - 1);
    const cv::Vec3b& pixel = bgr.at<cv::Vec3b>(y, x);
    k.rgb = {pixel[2], pixel[1], pixel[0]};
  }
}

}  // namespace

Result<std::vector<uint8_t>> PhotoPreparer::ReadBytes(const PhotoSource& source) const {
  std::error_code error;
  const auto size = std::filesystem::file_size(source.path, error);
  if (error) return Status::NotFound("cannot read " + source.path + ": " + error.message());
  if (size > options_.limits.size_bytes_max) {
    return Status::InvalidArgument("the file has " + std::to_string(size) + " bytes; at most " +
                                   std::to_string(options_.limits.size_bytes_max) +
                                   " are accepted");
  }
  std::ifstream file(source.path, std::ios::binary);
  std::vector<uint8_t> bytes(size);
  if (!file ||
      !file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    return Status::NotFound("cannot read " + source.path);
  }
  return bytes;
}

Result<Features> PhotoPreparer::ExtractFeaturesOf(const cv::Mat& gray) const {
  std::unique_ptr<FeatureScratch> scratch;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_scratch_.empty()) {
      scratch = std::move(idle_scratch_.back());
      idle_scratch_.pop_back();
    }
  }
  if (!scratch) scratch = std::make_unique<FeatureScratch>();
  Result<Features> features = ExtractFeatures({gray.data, gray.cols, gray.rows, gray.step},
                                              options_.features, scratch.get());
  if (gray.total() > kScratchPixelsMax) return features;
  const std::lock_guard lock(mutex_);
  idle_scratch_.push_back(std::move(scratch));
  return features;
}

void PhotoPreparer::ExtractBytes(std::span<const uint8_t> bytes,
                                 const std::optional<CameraModel>& camera,
                                 PreparedPhoto* photo) const {
  Stopwatch watch;
  const ImageSize wanted = camera ? ImageSize{camera->width_px, camera->height_px} : ImageSize{};
  DecodedPhoto decoded = DecodePhoto(bytes, options_.limits, wanted);
  photo->decode_ms += watch.LapMs();
  photo->reason = ReasonOf(decoded.outcome);
  photo->detail = decoded.detail;
  if (decoded.outcome != DecodeOutcome::kDecoded) return;
  photo->width_px = static_cast<uint32_t>(decoded.gray.cols);
  photo->height_px = static_cast<uint32_t>(decoded.gray.rows);

  cv::Mat gray = decoded.gray;
  const bool distorted = camera && IsDistorted(*camera);
  if (distorted) {
    Result<cv::Mat> straight = tables_->Undistort(*camera, gray);
    if (!straight.ok()) {
      photo->reason = Reason::kTooLarge;
      photo->detail = straight.status().message();
      return;
    }
    gray = *straight;
  }
  photo->undistort_ms = watch.LapMs();

  Result<Features> features = ExtractFeaturesOf(gray);
  if (!features.ok()) {
    photo->reason = Reason::kNoTexture;
    photo->detail = features.status().message();
    return;
  }
  photo->features = std::move(*features);
  if (distorted) DropBorder(*camera, options_.border_px, &photo->features);
  ColorFeatures(decoded.bgr, distorted ? &*camera : nullptr, &photo->features);
  photo->features_ms = watch.LapMs();
  if (photo->features.size() < options_.feature_count_min) {
    photo->reason = Reason::kNoTexture;
    photo->detail = "only " + std::to_string(photo->features.size()) +
                    " features found, at least " + std::to_string(options_.feature_count_min) +
                    " are needed: the photo is blank, too dark, too bright or out of focus";
  }
}

PreparedPhoto PhotoPreparer::Extract(const PhotoSource& source,
                                     const std::optional<CameraModel>& camera) const {
  PreparedPhoto photo;
  photo.name = source.name;
  Result<std::vector<uint8_t>> read = source.bytes ? Result(*source.bytes) : ReadBytes(source);
  if (!read.ok()) {
    photo.reason = read.status().code() == StatusCode::kInvalidArgument ? Reason::kTooLarge
                                                                        : Reason::kUnreadable;
    photo.detail = read.status().message();
    return photo;
  }
  photo.size_bytes = read->size();
  photo.hash = HashContent(*read);
  ExtractBytes(*read, camera, &photo);
  return photo;
}

Result<PreparedPhoto> PhotoPreparer::Prepare(const PhotoSource& source,
                                             const CameraModel& camera) const {
  Stopwatch watch;
  PreparedPhoto photo;
  photo.name = source.name;
  Result<std::vector<uint8_t>> read = source.bytes ? Result(*source.bytes) : ReadBytes(source);
  if (!read.ok()) {
    photo.reason = read.status().code() == StatusCode::kInvalidArgument ? Reason::kTooLarge
                                                                        : Reason::kUnreadable;
    photo.detail = read.status().message();
    return photo;
  }
  photo.size_bytes = read->size();
  photo.hash = HashContent(*read);
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          database_->GetSnapshot()->FindImageByPhoto(photo.hash));
  photo.known = stored.has_value();
  photo.decode_ms = watch.LapMs();
  if (photo.known) return photo;
  ExtractBytes(*read, camera, &photo);
  if (photo.reason == Reason::kNone) {
    VEDUTA_RETURN_IF_ERROR(database_->WritePhotoAhead(photo.hash, *read, photo.features));
  }
  return photo;
}

}  // namespace veduta
