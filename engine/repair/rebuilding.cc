// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/rebuilding.h"

namespace veduta {
namespace {

// Photos that are in memory at a time. Chosen by hand; not measured.
constexpr size_t kPhotosAtOnce = 16;

struct PhotoToAdd {
  std::string name;
  ContentHash photo;
  uint64_t size_bytes = 0;  // 0: not known
  std::string camera, contributor;
};

// A step that fails is set aside by the engine, and the next program tries it again.
void IgnoreStep(const FollowUp& /*step*/) {}

Status AddAll(const std::vector<PhotoToAdd>& photos, const Salvage& source, Engine* engine) {
  std::vector<PhotoSubmission> batch;
  for (size_t i = 0; i < photos.size(); ++i) {
    const PhotoToAdd& photo = photos[i];
    VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> bytes,
                            source.GetPhoto(photo.photo, photo.size_bytes));
    batch.push_back({{photo.name, "", std::move(bytes)}, photo.camera, photo.contributor});
    if (batch.size() < kPhotosAtOnce && i + 1 < photos.size()) continue;
    VEDUTA_RETURN_IF_ERROR(engine->AddPhotos(batch, {}, {}, IgnoreStep));
    batch.clear();
  }
  return Status::Ok();
}

std::vector<PhotoToAdd> LoosePhotosOf(const Healing& healing) {
  std::vector<PhotoToAdd> photos;
  for (const LoosePhoto& loose : healing.notes.loose) {
    if (!loose.camera.empty())
      photos.push_back({loose.name, loose.photo, 0, loose.camera, loose.contributor});
  }
  return photos;
}

}  // namespace

Status AddLoosePhotos(const Healing& healing, Engine* engine) {
  VEDUTA_RETURN_IF_ERROR(AddAll(LoosePhotosOf(healing), healing.source, engine));
  engine->Settle({}, IgnoreStep)
      .IgnoreBecause("a step that fails is tried again by the next program; verify comes after");
  return Status::Ok();
}

Status RebuildFromPhotos(const Healing& healing, Engine* engine) {
  for (const auto& [id, camera] : healing.cameras)
    VEDUTA_RETURN_IF_ERROR(engine->AddCamera(camera.name, camera.model, camera.source).status());
  std::vector<PhotoToAdd> photos;
  for (const auto& [id, image] : healing.images) {
    if (healing.FindPhoto(id) == nullptr) continue;
    photos.push_back({image.name, image.photo, image.size_bytes,
                      healing.cameras.at(image.camera).name, image.contributor});
  }
  VEDUTA_RETURN_IF_ERROR(AddAll(photos, healing.source, engine));
  return AddLoosePhotos(healing, engine);
}

}  // namespace veduta
