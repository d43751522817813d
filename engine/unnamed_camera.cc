// SPDX-License-Identifier: Apache-2.0
#include "engine/unnamed_camera.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>
#include <vector>

#include "engine/localization/unknown_localization.h"
#include "engine/photo/camera_group.h"
#include "engine/query/verdict_text.h"
#include "storage/model/awaited_photos.h"

namespace veduta {
namespace {

// Standard deviation of the focal length, over itself, up to which a group's photos have what one
// of them has told. Chosen by hand; not measured.
constexpr double kSettledShareMax = 0.005;

EstimatedUnnamed NoCamera(LocalizedPhoto photo) {
  EstimatedUnnamed none;
  AddOutcome& outcome = none.outcome;
  outcome.name = photo.name;
  outcome.damaged = std::move(photo.damaged);
  outcome.times = photo.times;
  outcome.failure = std::move(photo.failure);
  if (!outcome.failure.ok()) return none;
  if (photo.verdict == Verdict::kRejected) {
    outcome.reason = photo.reason;
    outcome.detail = std::move(photo.detail);
    return none;
  }
  outcome.failure = Status::NotFound(
      std::string("its camera is not known, and cannot be estimated yet: ") +
      ReasonText(photo.reason) + (photo.detail.empty() ? "" : ": " + photo.detail) +
      ". Name its camera, add it again when more photos are there, or begin a city with some ten "
      "photos of one camera at once");
  return none;
}

// Not of which photo: that may be removed, and the camera stays.
std::string SourceOf(const EstimatedCamera& camera) {
  char share[32];
  const auto [end, error] = std::to_chars(
      share, share + sizeof(share), 100 * camera.focal_stddev_share, std::chars_format::general, 2);
  return "estimated from a photo, its focal length to " + std::string(share, end) + " %";
}

}  // namespace

Result<std::optional<CameraRecord>> FindUnnamedCamera(EngineParts* parts,
                                                      const PhotoSource& photo) {
  VEDUTA_ASSIGN_OR_RETURN(const PhotoFacts facts, parts->preparer->Look(photo));
  return FindUnnamedCamera(parts, facts);
}

Result<std::optional<CameraRecord>> FindUnnamedCamera(EngineParts* parts, const PhotoFacts& facts) {
  const std::shared_ptr<const Snapshot> snapshot = parts->database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          snapshot->FindImageByPhoto(facts.hash));
  if (stored) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot->GetImage(*stored));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot->GetCamera(image.camera));
    return std::optional(camera);
  }
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> cameras, snapshot->ListCameras());
  for (CameraRecord& camera : cameras) {
    if (camera.awaited && std::ranges::count(camera.awaited->photos, facts.hash) > 0)
      return std::optional(std::move(camera));
  }
  return FindGroupCamera(*snapshot, facts.camera_group, facts.focal_share);
}

Result<EstimatedUnnamed> EstimateUnnamedCamera(EngineParts* parts, const PhotoSource& photo) {
  VEDUTA_ASSIGN_OR_RETURN(const PhotoFacts facts, parts->preparer->Look(photo));
  const std::shared_ptr<EngineCaches> caches = parts->GetCaches();
  const LocalizationParts localization{
      parts->database->GetSnapshot(), &caches->retrieval, &caches->features, parts->pool.get(),
      parts->tuning.ingest,           &caches->unsure};
  EstimatedUnnamed estimated;
  Result<LocalizedPhoto> localized =
      LocalizeUnknown(localization, *parts->preparer, photo, &estimated.camera);
  if (!localized.ok()) {  // of this photo alone, as far as anybody knows: nothing was written
    LocalizedPhoto failed;
    failed.name = photo.name;
    failed.failure = localized.status();
    return NoCamera(std::move(failed));
  }
  estimated.outcome.times = localized->times;
  if (estimated.camera) return estimated;
  if (!localized->camera) return NoCamera(std::move(*localized));
  const EstimatedCamera& camera = *localized->camera;
  estimated.camera = CameraRecord{{}, {}, camera.model, SourceOf(camera), true};
  estimated.camera->told_focal_share = facts.focal_share.value_or(0);
  estimated.camera->focal_stddev_share = camera.focal_stddev_share;
  if (camera.focal_stddev_share <= kSettledShareMax) estimated.camera->name = facts.camera_group;
  return estimated;
}

}  // namespace veduta
