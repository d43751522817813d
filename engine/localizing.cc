// SPDX-License-Identifier: Apache-2.0
// Questions::Localize.
#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "engine/localization/near_images.h"
#include "engine/localization/photo_localization.h"
#include "engine/localization/unknown_localization.h"
#include "engine/ordered_report.h"
#include "engine/parts.h"
#include "engine/photo/carried_features.h"
#include "engine/query/city_answers.h"
#include "engine/query/earth_answers.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

LocalizedPhoto Failed(const PhotoSource& photo, Status failure) {
  LocalizedPhoto failed;
  failed.name = photo.name;
  failed.failure = std::move(failure);
  return failed;
}

LocalizedPhoto LocalizeOne(const LocalizationParts& parts, const PhotoPreparer& preparer,
                           const PhotoSource& photo, const std::optional<CameraRecord>& camera) {
  if (!camera) {
    Result<LocalizedPhoto> localized = LocalizeUnknown(parts, preparer, photo);
    return localized.ok() ? std::move(*localized) : Failed(photo, localized.status());
  }
  PreparedPhoto prepared = ExtractCarried(preparer, photo, *camera);
  if (!prepared.failure.ok()) return Failed(photo, prepared.failure);
  Result<LocalizedPhoto> localized = LocalizePhoto(parts, std::move(prepared), camera->model);
  return localized.ok() ? std::move(*localized) : Failed(photo, localized.status());
}

// Takes out what must not be told: photos that the pose rests on, and which one has the same bytes.
Status MaskPhoto(const Visibility& visibility, LocalizedPhoto* photo) {
  VEDUTA_RETURN_IF_ERROR(visibility.Keep(&SupportAnswer::image, &photo->support));
  VEDUTA_RETURN_IF_ERROR(visibility.Keep(&DamagedImage::image, &photo->damaged));
  if (!photo->stored.valid()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(photo->stored));
  if (sees) return Status::Ok();
  photo->stored = {};
  if (photo->detail.starts_with("the same bytes are stored")) photo->detail = "";
  return Status::Ok();
}

// The images near which a photo was taken, each once.
Result<std::vector<ImageId>> NearOf(const Snapshot& snapshot, const LocalizeRequest& request,
                                    const Sight& sight) {
  std::vector<ImageId> near;
  if (!request.near.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(near, ImagesNear(snapshot, request.near, sight));
  }
  if (!request.near_place) return near;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> there,
                          ImagesNear(snapshot, *request.near_place));
  for (const ImageId image : there) {
    if (std::ranges::find(near, image) == near.end()) near.push_back(image);
  }
  return near;
}

void PutOnEarth(const Snapshot& snapshot, LocalizedPhoto* photo) {
  if (!photo->cam_from_world) return;
  auto on_earth =
      EarthPoseIn(snapshot, photo->reconstruction, *photo->cam_from_world, photo->uncertainty);
  if (on_earth.ok()) {
    photo->on_earth = std::move(*on_earth);
  } else {
    *photo = Failed({photo->name, {}, {}}, on_earth.status());
  }
}

}  // namespace

Status LocalizeRequest::Check() const {
  if (!photo.path.empty() || photo.bytes) return Status::Ok();
  return Status::InvalidArgument(
      "photo.path is empty, but must name a file where photo.bytes is not set");
}

Status Questions::Localize(std::span<const LocalizeRequest> photos,
                           const std::function<void(const LocalizedPhoto&)>& report,
                           std::stop_token stop) const {
  std::map<std::string, std::optional<CameraRecord>> cameras;
  std::vector<std::vector<ImageId>> near(photos.size());
  for (size_t i = 0; i < photos.size(); ++i) {
    const LocalizeRequest& request = photos[i];
    const std::string name = "LocalizeRequest[" + std::to_string(i) + "]";
    VEDUTA_RETURN_IF_ERROR(OptionBounds().Part(name.c_str(), request.Check()).status());
    if (i > 0 && request.near == photos[i - 1].near &&
        request.near_place == photos[i - 1].near_place) {
      near[i] = near[i - 1];
    } else {
      VEDUTA_ASSIGN_OR_RETURN(near[i], NearOf(*view_->snapshot, request, view_->sight));
    }
    if (request.camera.empty()) cameras[""] = std::nullopt;
    if (cameras.contains(request.camera)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera,
                            FindCamera(*view_->snapshot, request.camera));
    cameras.emplace(request.camera, camera);
  }
  EngineParts& parts = *view_->parts;
  OrderedReport<LocalizedPhoto> ordered(report);
  std::atomic<bool> is_stopped = false;
  parts.pool->ParallelFor(photos.size(), [&](size_t i) {
    if (is_stopped || stop.stop_requested()) {
      is_stopped = true;
      return;
    }
    const LocalizeRequest& request = photos[i];
    const LocalizationParts localization{
        view_->snapshot,  &view_->caches->retrieval, &view_->caches->features,
        parts.pool.get(), parts.tuning.ingest,       &view_->caches->unsure,
        near[i]};
    LocalizedPhoto photo =
        LocalizeOne(localization, *parts.preparer, request.photo, cameras.at(request.camera));
    PutOnEarth(*view_->snapshot, &photo);
    if (const veduta::Status masked = MaskPhoto(view_->visibility(), &photo); !masked.ok())
      photo = Failed(request.photo, masked);
    ordered.Done(i, std::move(photo));
  });
  return is_stopped ? veduta::Status::Cancelled("stopped before the next photo") : veduta::Status();
}

}  // namespace veduta
