// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/carried_features.h"

#include "engine/camera/projection.h"

namespace veduta {

void CarryKeypoints(const CameraRecord& camera, std::span<Keypoint> keypoints) {
  if (!camera.refined_from || !CheckCamera(camera.model).ok() ||
      !CheckCamera(*camera.refined_from).ok()) {
    return;
  }
  for (Keypoint& k : keypoints) {
    const Eigen::Vector2d photo_px = DistortPixel(*camera.refined_from, {k.x_px, k.y_px});
    const auto place = UndistortPixel(camera.model, photo_px);
    if (!place) continue;  // not within the photo
    k.x_px = static_cast<float>(place->x()), k.y_px = static_cast<float>(place->y());
  }
}

std::shared_ptr<const Features> Carried(const CameraRecord& camera,
                                        std::shared_ptr<const Features> extracted) {
  if (!camera.refined_from) return extracted;
  const auto carried = std::make_shared<Features>(*extracted);
  CarryKeypoints(camera, carried->keypoints);
  return carried;
}

PreparedPhoto ExtractCarried(const PhotoPreparer& preparer, const PhotoSource& source,
                             const CameraRecord& camera) {
  PreparedPhoto photo = preparer.Extract(source, camera.extraction_model());
  CarryKeypoints(camera, photo.features.keypoints);
  return photo;
}

}  // namespace veduta
