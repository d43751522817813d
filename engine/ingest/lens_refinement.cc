// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/lens_refinement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "engine/journal/camera_entry.h"
#include "engine/mapping/bundle_adjustment.h"

namespace veduta {
namespace {

// All chosen by hand. Lenses are refined at 12 images, and each time that there are so many times
// more.
constexpr uint32_t kImagesMin = 12, kImagesMax = 600;
constexpr double kGrowth = 1.5;

CameraModel Scaled(CameraModel model, double factor) {
  model.fx *= factor, model.fy *= factor;
  model.k1 *= factor * factor;
  model.k2 *= factor * factor * factor * factor;
  return model;
}

// Images of a camera that have a pose: in the reconstruction, and in others.
struct PlacedImages {
  std::vector<ImageRecord> own, others;
};

Result<std::map<CameraId, PlacedImages>> ListPlaced(const Snapshot& snapshot,
                                                    ReconstructionId reconstruction,
                                                    std::span<const RefinedLens> lenses) {
  std::map<CameraId, PlacedImages> placed;
  for (const RefinedLens& lens : lenses) placed[lens.camera];
  Status read = Status::Ok();
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    const auto of_camera = placed.find(image.camera);
    if (of_camera == placed.end()) return true;
    const Result<std::optional<PoseRecord>> pose = snapshot.FindPose(image.id);
    if (!pose.ok()) read = pose.status();
    if (!pose.ok() || !*pose) return pose.ok();
    const bool is_own = (*pose)->reconstruction == reconstruction;
    (is_own ? of_camera->second.own : of_camera->second.others).push_back(image);
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(read);
  return placed;
}

// "NAME (2)", or the next number that is free.
std::string NextName(const std::string& name, std::span<const CameraRecord> known) {
  for (uint32_t number = 2;; ++number) {
    std::string next = name + " (" + std::to_string(number) + ")";
    if (std::ranges::count(known, next, &CameraRecord::name) == 0) return next;
  }
}

}  // namespace

bool IsRefinementDue(const ReconstructionRecord& record) {
  if (record.image_count < kImagesMin || record.image_count > kImagesMax) return false;
  if (record.images_at_adjustment == 0) return true;
  for (double step = kImagesMin; step <= record.image_count; step *= kGrowth)
    if (record.images_at_adjustment < step) return true;
  return false;
}

Result<std::vector<RefinedLens>> RefineLenses(const MappingContext& context,
                                              std::span<const ImageId> images) {
  const Snapshot& snapshot = context.loader->snapshot();
  std::map<CameraId, bool> is_refinable;
  std::map<CameraId, uint32_t> number_of;
  std::map<ImageId, uint32_t> lens_of;
  std::vector<RefinedLens> lenses;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
    if (!is_refinable.contains(image.camera)) {
      VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
      is_refinable[image.camera] = camera.is_refinable;
    }
    if (!is_refinable[image.camera]) continue;
    const auto [at, is_new] =
        number_of.try_emplace(image.camera, static_cast<uint32_t>(lenses.size()));
    if (is_new) lenses.push_back({image.camera});
    lens_of[id] = at->second;
  }
  if (lenses.empty()) return lenses;
  VEDUTA_ASSIGN_OR_RETURN(
      const std::vector<double> factors,
      AdjustBundleWithLenses(context.map, images, context.map->PointsSeenBy(images), lens_of,
                             static_cast<uint32_t>(lenses.size()), context.options.global_bundle));
  for (size_t i = 0; i < lenses.size(); ++i) lenses[i].factor = factors[i];
  return lenses;
}

Result<std::vector<ImageId>> WriteLenses(const Snapshot& snapshot, ReconstructionId reconstruction,
                                         std::span<const RefinedLens> lenses, DatabaseState* state,
                                         Transaction* transaction) {
  std::vector<ImageId> changed;
  if (lenses.empty()) return changed;
  VEDUTA_ASSIGN_OR_RETURN(auto placed, ListPlaced(snapshot, reconstruction, lenses));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> known, snapshot.ListCameras());
  for (const RefinedLens& lens : lenses) {
    VEDUTA_ASSIGN_OR_RETURN(CameraRecord camera, snapshot.GetCamera(lens.camera));
    PlacedImages& images = placed[lens.camera];
    for (const ImageRecord& image : images.own) changed.push_back(image.id);
    CameraRecord refined = camera;
    refined.model = Scaled(camera.model, lens.factor);
    if (!images.others.empty()) {
      const bool is_main = images.own.size() >= images.others.size();
      CameraRecord& apart = is_main ? camera : refined;
      apart.id = CameraId(state->next_camera++);
      apart.name = NextName(apart.name, known);
      known.push_back(apart);
      if (is_main) PutNewCamera(apart, state, transaction);
      for (ImageRecord& image : is_main ? images.others : images.own) {
        image.camera = apart.id;
        transaction->PutImage(image);
      }
    }
    PutNewCamera(refined, state, transaction);
  }
  return changed;
}

}  // namespace veduta
