// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/derived_features.h"

#include <utility>

#include "engine/photo/photo_preparer.h"

namespace veduta {

Result<Features> ReadOrDeriveFeatures(const Snapshot& snapshot, const ImageRecord& image,
                                      const CameraModel& camera, UndistortCache* tables) {
  Result<Features> stored = snapshot.GetFeatures(image.photo);
  if (stored.status().code() != StatusCode::kCorruption) return stored;
  const Result<StoredBytes> bytes = snapshot.GetPhoto(image.photo);
  if (!bytes.ok()) return stored;
  const PhotoPreparer preparer(nullptr, tables, PrepareOptions());
  PreparedPhoto photo = preparer.Extract(
      {image.name, "", std::vector<uint8_t>(bytes->bytes().begin(), bytes->bytes().end())}, camera);
  VEDUTA_RETURN_IF_ERROR(photo.failure);
  const bool is_same = photo.hash == image.photo && photo.reason == Reason::kNone &&
                       photo.features.size() == image.feature_count;
  return is_same ? Result<Features>(std::move(photo.features)) : std::move(stored);
}

}  // namespace veduta
