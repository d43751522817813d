// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/told_scene.h"

#include "engine/query/unsure_poses.h"

namespace veduta {
namespace {

Status AddHidden(const Snapshot& snapshot, std::set<ImageId>* untold) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HiddenRecord> hidden,
                          snapshot.moderation().ListHidden());
  std::set<uint32_t> contributions;
  for (const HiddenRecord& record : hidden) {
    if (record.kind == HiddenKind::kImage) untold->insert(ImageId(record.number));
    if (record.kind == HiddenKind::kContribution) contributions.insert(record.number);
  }
  if (contributions.empty()) return Status::Ok();
  return snapshot.ScanImages([&](const ImageRecord& image) {
    if (contributions.contains(image.contribution)) untold->insert(image.id);
    return true;
  });
}

}  // namespace

Result<std::set<ImageId>> ListUntold(const Snapshot& snapshot, bool with_hidden) {
  VEDUTA_ASSIGN_OR_RETURN(const UnsureImages unsure, ListUnsure(snapshot));
  std::set<ImageId> untold;
  for (const auto& [image, others] : unsure) untold.insert(image);
  if (!with_hidden) VEDUTA_RETURN_IF_ERROR(AddHidden(snapshot, &untold));
  return untold;
}

Result<Scene> LoadToldScene(const Snapshot& snapshot, ReconstructionId reconstruction,
                            bool with_hidden) {
  VEDUTA_ASSIGN_OR_RETURN(Scene scene, LoadScene(snapshot, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const std::set<ImageId> untold, ListUntold(snapshot, with_hidden));
  std::erase_if(scene.images, [&](const auto& image) { return untold.contains(image.first); });
  return scene;
}

}  // namespace veduta
