// SPDX-License-Identifier: Apache-2.0
#pragma once
// Every field of the state, of cameras, images, features and the journal, each with a change.

#include <string>
#include <vector>

#include "storage/records/camera_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/state_record.h"
#include "storage/records/vocabulary_record.h"
#include "tests/engine/query/field_edit.h"

namespace veduta {

inline std::vector<FieldDamage> StateDamages() {
  using R = DatabaseState;
  const auto read = [](const std::string& key, const std::string& value, R* state) {
    return key == kStateKey ? Decode(value, state) : Status::NotFound("another key");
  };
  return DamagesOf<R>(
      {{"nextImage", [](R* r) { r->next_image += 1; }},
       {"nextCamera", [](R* r) { r->next_camera += 1; }},
       {"nextReconstruction", [](R* r) { r->next_reconstruction += 1; }},
       {"nextJournal", [](R* r) { r->next_journal += 1; }},
       {"nextBlob", [](R* r) { r->next_blob += 1; }},
       {"vocabularyGeneration", [](R* r) { r->vocabulary_generation += 1; }},
       {"vocabularyGeneration", [](R* r) { r->vocabulary_generation = 0; }},
       {"imagesAtVocabulary", [](R* r) { r->images_at_vocabulary -= 1; }},
       {"vocabularyImported", [](R* r) { r->vocabulary_imported ^= true; }},
       {"retrievableImageCount", [](R* r) { r->retrievable_image_count += 1; }},
       {"pendingPropagation", [](R* r) { r->pending_propagation.push_back(ImageId(1)); }},
       {"pendingPropagation", [](R* r) { r->pending_propagation.push_back(ImageId(999)); }},
       {"imageCount", [](R* r) { r->counts->images += 1; }},
       {"placedCount", [](R* r) { r->counts->placed -= 1; }},
       {"postponedCount", [](R* r) { r->counts->postponed += 1; }},
       {"rejectedCount", [](R* r) { r->counts->rejected += 1; }},
       {"cameraCount", [](R* r) { r->counts->cameras += 1; }}},
      read, [](const R& state) { return Encode(state); });
}

inline std::vector<FieldDamage> CameraDamages() {
  using R = CameraRecord;
  const auto refined_from = [](double CameraModel::*number, double off) {
    return [=](R* r) { r->refined_from.emplace(r->model).*number += off; };
  };
  return DamagesOf<R>({{"name", [](R* r) { r->name += "x"; }},
                       {"source", [](R* r) { r->source += "x"; }},
                       {"widthPx", [](R* r) { r->model.width_px += 1; }},
                       {"heightPx", [](R* r) { r->model.height_px += 1; }},
                       {"fx", [](R* r) { r->model.fx *= 1.01; }},
                       {"fy", [](R* r) { r->model.fy *= 1.01; }},
                       {"cx", [](R* r) { r->model.cx += 1; }},
                       {"cy", [](R* r) { r->model.cy += 1; }},
                       {"k1", [](R* r) { r->model.k1 += 0.01; }},
                       {"k2", [](R* r) { r->model.k2 += 0.01; }},
                       {"isRefinable", [](R* r) { r->is_refinable = !r->is_refinable; }},
                       {"toldFocalShare", [](R* r) { r->told_focal_share += 0.5; }},
                       {"focalStddevShare", [](R* r) { r->focal_stddev_share += 0.5; }},
                       {"version", [](R* r) { r->version += 1; }},
                       {"refinedFromFx", refined_from(&CameraModel::fx, 9)},
                       {"refinedFromFy", refined_from(&CameraModel::fy, 9)},
                       {"refinedFromK1", refined_from(&CameraModel::k1, 0.03)},
                       {"refinedFromK2", refined_from(&CameraModel::k2, 0.03)},
                       {"u0", [](R* r) { r->model.u0 += 5; }},
                       {"v0", [](R* r) { r->model.v0 += 5; }}});
}

inline std::vector<FieldDamage> ImageDamages() {
  using R = ImageRecord;
  const auto other_verdict = [](Verdict verdict) {
    return [verdict](R* r) { r->verdict = verdict; };
  };
  return DamagesOf<R>({{"name", [](R* r) { r->name += "x"; }},
                       {"photo", [](R* r) { r->photo.bytes[3] ^= 4; }},
                       {"camera", [](R* r) { r->camera = CameraId(3 - r->camera.value); }},
                       {"widthPx", [](R* r) { r->width_px += 1; }},
                       {"heightPx", [](R* r) { r->height_px += 1; }},
                       {"sizeBytes", [](R* r) { r->size_bytes += 1; }},
                       {"featureCount", [](R* r) { r->feature_count += 1; }},
                       {"contributor", [](R* r) { r->contributor += "x"; }},
                       {"timeUnixS", [](R* r) { r->time_unix_s += 1; }},
                       {"verdict", other_verdict(Verdict::kPlaced)},
                       {"verdict", other_verdict(Verdict::kMerged)},
                       {"verdict", other_verdict(Verdict::kFounded)},
                       {"verdict", other_verdict(Verdict::kPostponed)},
                       {"verdict", other_verdict(Verdict::kRejected)},
                       {"reason",
                        [](R* r) {
                          r->reason = r->reason == Reason::kRegistered ? Reason::kGoodTriple
                                                                       : Reason::kRegistered;
                        }},
                       {"reason within its verdict",
                        [](R* r) {
                          if (r->verdict == Verdict::kPlaced)
                            r->reason = r->reason == Reason::kRegistered ? Reason::kPropagated
                                                                         : Reason::kRegistered;
                          if (r->verdict == Verdict::kPostponed)
                            r->reason = Reason::kContradictsNeighbors;
                          if (r->verdict == Verdict::kRejected) r->reason = Reason::kTooLarge;
                        }},
                       {"detail", [](R* r) { r->detail += "x"; }}});
}

inline std::vector<FieldDamage> IndexDamages(bool is_name) {
  const auto edit = [](auto* entry) { entry->image.value += 1; };
  const auto write = [](const auto& entry) { return EncodeImages({&entry.image, 1}); };
  if (is_name)
    return DamagesOf<NameEntry>(
        {{"image", edit}},
        [](auto& key, auto& value, NameEntry* e) { return ReadStored(key, value, e); }, write);
  return DamagesOf<HashEntry>(
      {{"image", edit}},
      [](auto& key, auto& value, HashEntry* e) { return ReadStored(key, value, e); }, write);
}

inline std::vector<FieldDamage> FeaturesDamages() {
  using R = FeaturesEntry;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) { return Encode(r.features); };
  const auto middle = [](R* r) -> Keypoint& {
    return r->features.keypoints[r->features.size() / 2];
  };
  return DamagesOf<R>(
      {{"keypoints: beside the photo", [=](R* r) { middle(r).x_px = 1e6f; }},
       {"keypoints: x of one", [=](R* r) { middle(r).x_px += 3; }},
       {"keypoints: y of one", [=](R* r) { middle(r).y_px += 3; }},
       {"keypoints: scale of one", [=](R* r) { middle(r).scale_px *= 1.5f; }},
       {"keypoints: angle of one", [=](R* r) { middle(r).angle_deg /= 2; }},
       {"keypoints: response of one", [=](R* r) { middle(r).response *= 3; }},
       {"keypoints: response of the last, to less",
        [=](R* r) { r->features.keypoints.back().response /= 2; }},
       {"keypoints: sign of one", [=](R* r) { middle(r).contrast_sign *= -1; }},
       {"keypoints: an impossible sign", [=](R* r) { middle(r).contrast_sign = 0; }},
       {"keypoints: color of one", [=](R* r) { middle(r).rgb[1] ^= 16; }},
       {"keypoints and descriptors: one less",
        [](R* r) {
          r->features.keypoints.pop_back();
          r->features.descriptors.resize(r->features.descriptors.size() - kDescriptorSize);
        }},
       {"descriptors: one byte", [](R* r) { r->features.descriptors[1000] ^= 1; }},
       {"descriptors: all of one",
        [](R* r) {
          for (int i = 0; i < kDescriptorSize; ++i)
            r->features.descriptors[1280 + i] ^= static_cast<uint8_t>(255 * (i % 2));
        }}},
      read, write);
}

inline std::vector<FieldDamage> JournalDamages() {
  using R = JournalRecord;
  return DamagesOf<R>({{"timeUnixS", [](R* r) { r->time_unix_s += 1; }},
                       {"actor", [](R* r) { r->actor += "x"; }},
                       {"action", [](R* r) { r->action += "x"; }},
                       {"image", [](R* r) { r->image.value += 500; }},
                       {"reconstruction", [](R* r) { r->reconstruction.value += 500; }},
                       {"detail", [](R* r) { r->detail += "x"; }}});
}

}  // namespace veduta
