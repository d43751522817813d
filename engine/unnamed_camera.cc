// SPDX-License-Identifier: Apache-2.0
#include "engine/unnamed_camera.h"

#include <cstdio>
#include <string>
#include <utility>

#include "engine/localization/unknown_localization.h"
#include "engine/query/verdict_text.h"

namespace veduta {
namespace {

// Standard deviation of the focal length, over itself, up to which a group's photos have what one
// of them has told. Chosen by hand; not measured.
constexpr double kSettledShareMax = 0.005;
// Of a photo's hash in the name of its camera: 64 bits, which no other photo has.
constexpr size_t kHashDigits = 16;

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
      ". Name its camera, or add it again when more photos are there");
  return none;
}

std::string SourceOf(const PhotoSource& photo, const EstimatedCamera& camera) {
  char share[32];
  std::snprintf(share, sizeof(share), "%.2g", 100 * camera.focal_stddev_share);
  return "estimated from photo " + photo.name + ", its focal length to " + share + " %";
}

}  // namespace

Result<std::optional<CameraRecord>> FindUnnamedCamera(EngineParts* parts,
                                                      const PhotoSource& photo) {
  VEDUTA_ASSIGN_OR_RETURN(const PhotoFacts facts, parts->preparer->Look(photo));
  const std::shared_ptr<const Snapshot> snapshot = parts->database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          snapshot->FindImageByPhoto(facts.hash));
  if (stored) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot->GetImage(*stored));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot->GetCamera(image.camera));
    return std::optional(camera);
  }
  if (facts.camera_group.empty()) return std::optional<CameraRecord>();
  Result<CameraRecord> camera = parts->FindCamera(facts.camera_group);
  if (camera.status().code() == StatusCode::kNotFound) return std::optional<CameraRecord>();
  VEDUTA_RETURN_IF_ERROR(camera.status());
  return std::optional(std::move(*camera));
}

Result<EstimatedUnnamed> EstimateUnnamedCamera(EngineParts* parts, const PhotoSource& photo) {
  VEDUTA_ASSIGN_OR_RETURN(const PhotoFacts facts, parts->preparer->Look(photo));
  const std::shared_ptr<EngineCaches> caches = parts->GetCaches();
  const LocalizationParts localization{parts->database->GetSnapshot(), &caches->retrieval,
                                       &caches->features, parts->pool.get(), parts->tuning.ingest};
  VEDUTA_ASSIGN_OR_RETURN(LocalizedPhoto localized,
                          LocalizeUnknown(localization, *parts->preparer, photo));
  if (!localized.camera) return NoCamera(std::move(localized));
  const EstimatedCamera& camera = *localized.camera;
  const bool is_settled =
      !facts.camera_group.empty() && camera.focal_stddev_share <= kSettledShareMax;
  const std::string own = "photo " + facts.hash.Hex().substr(0, kHashDigits);
  const std::string& name = is_settled ? facts.camera_group : own;
  VEDUTA_RETURN_IF_ERROR(parts->AddCamera(name, camera.model, SourceOf(photo, camera)).status());
  VEDUTA_ASSIGN_OR_RETURN(CameraRecord record, parts->FindCamera(name));
  EstimatedUnnamed estimated;
  estimated.camera = std::move(record);
  estimated.outcome.times = localized.times;
  return estimated;
}

}  // namespace veduta
