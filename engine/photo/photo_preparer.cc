// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_preparer.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "engine/camera/projection.h"
#include "engine/photo/camera_group.h"
#include "engine/photo/photo_features.h"
#include "engine/photo/photo_file.h"
#include "engine/photo/private_features.h"
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
    case DecodeOutcome::kNoMemory:  // never a verdict; told before
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

// For what standard and other libraries throw: nothing else is thrown here.
Status NotEnoughMemory() {
  return Status::NoMemory("there is not enough memory to prepare the photo");
}

std::string ShapeOf(const PhotoHeader& header) {
  std::string shape = header.stored_size.Text();
  if (header.orientation != 1) shape += ", orientation " + std::to_string(header.orientation);
  return shape;
}

}  // namespace

Status PrepareOptions::Check() const {
  return OptionBounds()
      .Part("limits", limits.Check())
      .Part("features", features.Check())
      .AtLeast("feature_count_min", feature_count_min, 1)
      .AtLeast("border_px", border_px, 0)
      .AtLeast("memory_bytes", static_cast<double>(memory_bytes), 1)
      .status();
}

uint64_t PrepareBytes(uint64_t size_bytes, uint64_t pixel_count) {
  const uint64_t decoding = 16 * pixel_count;
  const uint64_t extraction = 5 * pixel_count + ExtractionBytes(pixel_count);
  return size_bytes + std::max(decoding, extraction);
}

std::optional<std::span<const uint8_t>> PhotoPreparer::ReadBytes(const PhotoSource& source,
                                                                 std::vector<uint8_t>* own,
                                                                 PreparedPhoto* photo) const {
  photo->name = source.name;
  if (!source.bytes) {
    const uint64_t size_bytes_max = options_.limits.size_bytes_max;
    if (const uint64_t size = PhotoFileSize(source.path); size > size_bytes_max) {
      photo->reason = Reason::kTooLarge;
      photo->detail = "the file has " + std::to_string(size) + " bytes; at most " +
                      std::to_string(size_bytes_max) + " are accepted";
      return std::nullopt;
    }
    Result<std::vector<uint8_t>> read =
        source.read ? source.read() : ReadPhotoFile(source.path, size_bytes_max);
    if (!read.ok()) {
      photo->failure = read.status();
      return std::nullopt;
    }
    *own = std::move(*read);
  }
  const std::span<const uint8_t> bytes = source.bytes ? *source.bytes : *own;
  photo->size_bytes = bytes.size();
  photo->hash = HashContent(bytes);
  return bytes;
}

Result<PhotoFacts> PhotoPreparer::Look(const PhotoSource& source) const {
  try {
    const uint64_t size_bytes = source.bytes ? 0 : PhotoFileSize(source.path);
    const MemoryBudget::Share share =
        TakeMemory(std::min(size_bytes, options_.limits.size_bytes_max));
    PreparedPhoto photo;
    std::vector<uint8_t> own;
    const auto bytes = ReadBytes(source, &own, &photo);
    VEDUTA_RETURN_IF_ERROR(photo.failure);
    if (!bytes) return PhotoFacts();
    const PhotoExamination examined = decoder_.Examine(*bytes);
    const PhotoHeader& header = examined.header;
    if (header.outcome == HeaderOutcome::kNoMemory) return NotEnoughMemory();
    PhotoFacts facts{photo.hash, CameraGroupOf(examined.camera, header), {}, {}};
    if (header.outcome == HeaderOutcome::kRead) {
      facts.focal_share = FocalShareOf(examined.camera, header.stored_size);
      facts.shape = ShapeOf(header);
      facts.is_upside_down = header.orientation == 3;
    }
    return facts;
  } catch (const std::exception&) {
    return NotEnoughMemory();
  }
}

DecodedPhoto PhotoPreparer::Decode(std::span<const uint8_t> bytes) const {
  const PhotoHeader header = decoder_.Examine(bytes).header;
  const MemoryBudget::Share share = TakeMemory(NeededBytes(0, header.stored_size.pixel_count()));
  return DecodePhoto(decoder_, bytes, header, options_.limits);
}

void PhotoPreparer::DropIdleScratch() const {
  std::vector<IdleScratch> dropped;
  const std::lock_guard lock(mutex_);
  dropped.swap(idle_scratch_);
}

uint64_t PhotoPreparer::NeededBytes(uint64_t size_bytes, uint64_t pixel_count) const {
  return PrepareBytes(size_bytes, pixel_count) + decoder_.HandoverBytes(size_bytes, pixel_count);
}

MemoryBudget::Share PhotoPreparer::TakeMemory(uint64_t bytes) const {
  return budget_.Take(bytes, [this] { DropIdleScratch(); });
}

Result<Features> PhotoPreparer::ExtractFeaturesOf(const cv::Mat& gray) const {
  IdleScratch idle;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_scratch_.empty()) {
      idle = std::move(idle_scratch_.back());
      idle_scratch_.pop_back();
    }
  }
  if (!idle.scratch) idle.scratch = std::make_unique<FeatureScratch>();
  Result<Features> features = ExtractPhotoFeatures(gray, options_.features, idle.scratch.get());
  if (!features.ok() || gray.total() > kScratchPixelsMax) return features;
  idle.size_bytes = std::max(idle.size_bytes, ExtractionBytes(gray.total()));
  idle.share = {};
  std::optional<MemoryBudget::Share> share = budget_.TryTake(idle.size_bytes);
  if (!share) return features;
  idle.share = std::move(*share);
  {
    const std::lock_guard lock(mutex_);
    idle_scratch_.push_back(std::move(idle));
  }
  // Whoever began to wait before the scratch lay there has not dropped it.
  if (budget_.HasWaiters()) DropIdleScratch();
  return features;
}

void PhotoPreparer::ExtractBytes(std::span<const uint8_t> bytes, const PhotoHeader& header,
                                 const std::optional<CameraModel>& camera, PhotoLayout preferred,
                                 PreparedPhoto* photo) const {
  Stopwatch watch;
  const ImageSize size = camera ? ImageSize{camera->width_px, camera->height_px} : ImageSize{};
  DecodedPhoto decoded = DecodePhoto(decoder_, bytes, header, options_.limits, {size, preferred});
  photo->decode_ms += watch.LapMs();
  if (decoded.outcome == DecodeOutcome::kNoMemory) {
    photo->failure = Status::NoMemory(decoded.detail);
    return;
  }
  photo->reason = ReasonOf(decoded.outcome);
  photo->detail = decoded.detail;
  if (decoded.outcome != DecodeOutcome::kDecoded) return;
  photo->width_px = static_cast<uint32_t>(decoded.gray.cols);
  photo->height_px = static_cast<uint32_t>(decoded.gray.rows);
  photo->orientation = decoded.images_orientation();

  cv::Mat gray = decoded.gray;
  const bool distorted = camera && IsDistorted(*camera);
  if (distorted) {
    Result<cv::Mat> straight = tables_->Undistort(*camera, gray);
    if (straight.status().code() == StatusCode::kNoMemory) {
      photo->failure = straight.status();
      return;
    }
    if (!straight.ok()) {
      photo->reason = Reason::kTooLarge;
      photo->detail = straight.status().message();
      return;
    }
    gray = *straight;
  }
  photo->undistort_ms = watch.LapMs();

  Result<Features> features = ExtractFeaturesOf(gray);
  if (features.status().code() == StatusCode::kNoMemory) {
    photo->failure = features.status();
    return;
  }
  if (!features.ok()) {
    photo->reason = Reason::kNoTexture;
    photo->detail = features.status().message();
    return;
  }
  photo->features = std::move(*features);
  if (distorted) DropBorder(*camera, options_.border_px, &photo->features);
  DropPrivate(decoded.private_areas, distorted ? &*camera : nullptr, &photo->features);
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
                                     const std::optional<CameraModel>& camera,
                                     PhotoLayout preferred) const {
  PreparedPhoto photo;
  try {
    std::vector<uint8_t> own;
    const auto bytes = ReadBytes(source, &own, &photo);
    if (!bytes) return photo;
    const PhotoHeader header = decoder_.Examine(*bytes).header;
    const MemoryBudget::Share share =
        TakeMemory(NeededBytes(bytes->size(), header.stored_size.pixel_count()));
    ExtractBytes(*bytes, header, camera, preferred, &photo);
  } catch (const std::exception&) {
    photo.failure = NotEnoughMemory();
  }
  return photo;
}

Result<PreparedPhoto> PhotoPreparer::PrepareWithin(const PhotoSource& source,
                                                   const CameraModel& camera,
                                                   const std::string& contributor) const {
  Stopwatch watch;
  PreparedPhoto photo;
  std::vector<uint8_t> own;
  const auto bytes = ReadBytes(source, &own, &photo);
  if (!bytes) return photo;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          database_->GetSnapshot()->FindImageByPhoto(photo.hash));
  photo.known = stored.has_value();
  photo.decode_ms = watch.LapMs();
  if (photo.known) return photo;
  const PhotoExamination examined = decoder_.Examine(*bytes);
  photo.gps = examined.gps;
  photo.taken = examined.taken;
  photo.media_type = MediaTypeOf(examined.header.format);
  ExtractBytes(*bytes, examined.header, camera, PhotoLayout::kAsStored, &photo);
  if (photo.reason == Reason::kNone && photo.failure.ok()) {
    VEDUTA_RETURN_IF_ERROR(
        database_->WritePhotoAhead(photo.hash, *bytes, photo.features, {source.name, contributor}));
    photo.written_ahead = WrittenAhead::Photo(database_, photo.hash);
  }
  return photo;
}

Result<PreparedPhoto> PhotoPreparer::Prepare(const PhotoSource& source, const CameraModel& camera,
                                             const std::string& contributor,
                                             Company company) const {
  try {
    // A photo of another size than the camera's is not decoded.
    const uint64_t pixel_count = ImageSize{camera.width_px, camera.height_px}.pixel_count();
    const uint64_t size_bytes = source.bytes ? source.bytes->size() : PhotoFileSize(source.path);
    const uint64_t needed =
        NeededBytes(std::min(size_bytes, options_.limits.size_bytes_max), pixel_count);
    const MemoryBudget::Share share =
        TakeMemory(company == Company::kAlone ? std::max(needed, budget_.bytes_max()) : needed);
    return PrepareWithin(source, camera, contributor);
  } catch (const std::exception&) {
    PreparedPhoto photo;
    photo.name = source.name;
    photo.failure = NotEnoughMemory();
    return photo;
  }
}

}  // namespace veduta
