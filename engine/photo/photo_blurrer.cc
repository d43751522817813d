// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/photo_blurrer.h"

#include <algorithm>

#include "engine/camera/filled_photo.h"
#include "engine/photo/photo_file.h"
#include "storage/base/memory_shortage.h"

namespace veduta {

Result<BlurredPhoto> PhotoBlurrer::Blur(const PhotoSource& photo) const {
  return CatchShortage("blur the photo", [&]() -> Result<BlurredPhoto> {
    if (photo.bytes) return BlurBytes(*photo.bytes);
    const uint64_t size_bytes_max = DecodeLimits().size_bytes_max;
    if (!photo.read && PhotoFileSize(photo.path) > size_bytes_max) return BlurredPhoto();
    VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> bytes,
                            photo.read ? photo.read() : ReadPhotoFile(photo.path, size_bytes_max));
    return BlurBytes(std::move(bytes));
  });
}

Result<BlurredPhoto> PhotoBlurrer::BlurBytes(std::vector<uint8_t> bytes) const {
  BlurredPhoto blurred;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          database_->GetSnapshot()->FindImageByPhoto(HashContent(bytes)));
  if (stored) return blurred;
  const PhotoExamination examined = preparer_->decoder().Examine(bytes);
  DecodedPhoto decoded = preparer_->Decode(bytes);
  if (decoded.outcome == DecodeOutcome::kNoMemory) return Status::NoMemory(decoded.detail);
  if (decoded.outcome != DecodeOutcome::kDecoded) return blurred;
  decoded.gray.release();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<uint8_t> picture, EncodePicture(decoded.bgr));
  VEDUTA_ASSIGN_OR_RETURN(
      std::vector<PixelArea> areas,
      AskBlurCommand(program_, picture, decoded.upright_size, limits_, is_stopped_));
  blurred.was_asked = true;
  if (areas.empty()) return blurred;
  // Those of a photo that was filled before, by whomever, stay what they are.
  for (const PixelArea& area : decoded.private_areas) {
    if (areas.size() < kPrivateAreasMax && std::ranges::find(areas, area) == areas.end())
      areas.push_back(area);
  }
  VEDUTA_ASSIGN_OR_RETURN(blurred.filled, FillPhoto(decoded.bgr, examined, areas));
  blurred.original = std::move(bytes);
  return blurred;
}

}  // namespace veduta
