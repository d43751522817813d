// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_preparer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "engine/camera/projection.h"
#include "storage/base/option_bounds.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// After a photo of more pixels its scratch memory is given back, for each thread would keep some:
// 16 Mpx of the 9 bytes for each pixel of the doubled photo (FeatureScratch) are 600 MB. Chosen by
// hand; not measured.
constexpr size_t kScratchPixelsMax = 16 << 20;

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

// Drops features on the artificial border of the undistorted photo; the others keep their order.
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

// Colours come from the photo as it was taken. `camera` tells where each feature lies there; where
// it is null, the photo was not distorted and the feature lies where it was found.
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

Status PrepareOptions::Check() const {
  return OptionBounds()
      .Part("limits", limits.Check())
      .Part("features", features.Check())
      .AtLeast("feature_count_min", feature_count_min, 1)
      .AtLeast("border_px", border_px, 0)
      .status();
}

Result<std::vector<uint8_t>> PhotoPreparer::ReadFile(const std::string& path) const {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) return Status::NotFound("cannot read " + path + ": " + error.message());
  if (size > options_.limits.size_bytes_max) {
    return Status::InvalidArgument("the file has " + std::to_string(size) + " bytes; at most " +
                                   std::to_string(options_.limits.size_bytes_max) +
                                   " are accepted");
  }
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes(size);
  if (!file ||
      !file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    return Status::NotFound("cannot read " + path);
  }
  return bytes;
}

std::optional<std::vector<uint8_t>> PhotoPreparer::ReadBytes(const PhotoSource& source,
                                                             PreparedPhoto* photo) const {
  photo->name = source.name;
  Result<std::vector<uint8_t>> read = source.bytes ? Result(*source.bytes) : ReadFile(source.path);
  if (!read.ok()) {
    const bool too_large = read.status().code() == StatusCode::kInvalidArgument;
    photo->reason = too_large ? Reason::kTooLarge : Reason::kUnreadable;
    photo->detail = read.status().message();
    return std::nullopt;
  }
  photo->size_bytes = read->size();
  photo->hash = HashContent(*read);
  return std::move(*read);
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
  const std::optional<std::vector<uint8_t>> bytes = ReadBytes(source, &photo);
  if (bytes) ExtractBytes(*bytes, camera, &photo);
  return photo;
}

Result<PreparedPhoto> PhotoPreparer::Prepare(const PhotoSource& source,
                                             const CameraModel& camera) const {
  Stopwatch watch;
  PreparedPhoto photo;
  const std::optional<std::vector<uint8_t>> bytes = ReadBytes(source, &photo);
  if (!bytes) return photo;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          database_->GetSnapshot()->FindImageByPhoto(photo.hash));
  photo.known = stored.has_value();
  photo.decode_ms = watch.LapMs();
  if (photo.known) return photo;
  ExtractBytes(*bytes, camera, &photo);
  if (photo.reason == Reason::kNone) {
    VEDUTA_RETURN_IF_ERROR(database_->WritePhotoAhead(photo.hash, *bytes, photo.features));
    photo.written_ahead = WrittenAhead::Photo(database_, photo.hash);
  }
  return photo;
}

}  // namespace veduta
