// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/derived_features.h"

#include <utility>

#include "engine/camera/projection.h"
#include "engine/photo/carried_features.h"
#include "engine/photo/photo_preparer.h"

namespace veduta {
namespace {

// The features from the photo; `stored`, a failure, where it does not give them.
Result<Features> Derive(const Snapshot& snapshot, const ImageRecord& image,
                        const CameraModel& camera, UndistortCache* tables,
                        const PhotoDecoder& decoder, Result<Features> stored) {
  const Result<StoredBytes> bytes = snapshot.GetPhoto(image.photo);
  if (!bytes.ok()) return stored;
  const PhotoPreparer preparer(nullptr, tables, PrepareOptions(), decoder);
  PreparedPhoto photo = preparer.Extract(
      {image.name, "", std::vector<uint8_t>(bytes->bytes().begin(), bytes->bytes().end())}, camera,
      StoredLayout(image.orientation));
  VEDUTA_RETURN_IF_ERROR(photo.failure);
  const bool is_same = photo.hash == image.photo && photo.reason == Reason::kNone &&
                       photo.features.size() == image.feature_count;
  return is_same ? Result<Features>(std::move(photo.features)) : std::move(stored);
}

}  // namespace

Result<Features> ReadOrDeriveFeatures(const Snapshot& snapshot, const ImageRecord& image,
                                      const CameraRecord& camera, UndistortCache* tables,
                                      const PhotoDecoder& decoder) {
  Result<Features> features = snapshot.GetFeatures(image.photo);
  if (features.status().code() == StatusCode::kCorruption) {
    features =
        Derive(snapshot, image, camera.extraction_model(), tables, decoder, std::move(features));
  }
  if (features.ok()) CarryKeypoints(camera, features->keypoints);
  return features;
}

Result<Features> ReadOrDeriveFeatures(const Snapshot& snapshot, const ImageRecord& image,
                                      const PhotoDecoder& decoder) {
  const Result<CameraRecord> camera = snapshot.GetCamera(image.camera);
  if (!camera.ok() || !CheckCamera(camera->model).ok() ||
      !CheckCamera(camera->extraction_model()).ok()) {
    return snapshot.GetFeatures(image.photo);
  }
  UndistortCache tables(0);
  return ReadOrDeriveFeatures(snapshot, image, *camera, &tables, decoder);
}

}  // namespace veduta
