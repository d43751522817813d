// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/uncertain_lenses.h"

#include <cstdint>
#include <map>
#include <vector>

namespace veduta {
namespace {

// A focal length is known to some percent where less than so many images of its camera are here,
// or in a reconstruction of less than so many images: of thirty telephones in a street, one of 56
// images had focal lengths that were 2 % off, one of 299 images 0.6 %. Chosen by hand.
constexpr uint32_t kImagesOfKnownMin = 12, kImagesOfOldMin = 100;
// The rotation that a pair finds by itself is then off by so many times more: pairs of right poses
// differed by 2 to 8 degrees there. Chosen by hand.
constexpr double kUncertainFactor = 4;

}  // namespace

Result<std::set<ImageId>> ListUncertainLenses(const Snapshot& snapshot,
                                              const std::set<ImageId>& members) {
  std::map<CameraId, std::vector<ImageId>> by_camera;
  for (const ImageId id : members) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
    by_camera[image.camera].push_back(id);
  }
  std::set<ImageId> uncertain;
  for (const auto& [id, images] : by_camera) {
    if (images.size() >= kImagesOfKnownMin) continue;
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(id));
    if (camera.is_refinable) uncertain.insert(images.begin(), images.end());
  }
  return uncertain;
}

Result<std::set<ImageId>> ListYoungLenses(MapLoader* loader, const CityMap& map,
                                          const std::set<ImageId>& images) {
  std::set<ImageId> young;
  for (const ImageId id : images) {
    const auto reconstruction = loader->GetReconstruction(map.image(id).reconstruction);
    // What was only now founded or split off is not stored yet.
    const bool is_new = reconstruction.status().code() == StatusCode::kNotFound;
    if (!is_new) VEDUTA_RETURN_IF_ERROR(reconstruction.status());
    if (!is_new && reconstruction->image_count >= kImagesOfOldMin) continue;
    const Result<ImageRecord> image = loader->snapshot().GetImage(id);
    // The photo that is being added; the other image of each of its pairs is stored.
    if (image.status().code() == StatusCode::kNotFound) continue;
    VEDUTA_RETURN_IF_ERROR(image.status());
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, loader->snapshot().GetCamera(image->camera));
    if (camera.is_refinable) young.insert(id);
  }
  return young;
}

AgreementOptions OfUncertainLenses(AgreementOptions options) {
  options.rotation_deg_max *= kUncertainFactor;
  options.rotation_px_max *= kUncertainFactor;
  return options;
}

}  // namespace veduta
