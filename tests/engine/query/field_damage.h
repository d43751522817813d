// SPDX-License-Identifier: Apache-2.0
#pragma once
// Every field of every record, each with a change to another value that looks as legal as the first.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/query/stored_records.h"
#include "storage/records/camera_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/state_record.h"
#include "storage/records/vocabulary_record.h"

namespace veduta {

struct FieldDamage {
  std::string field;
  // Another value for the key; none where the record has no such field, or cannot be changed so.
  std::function<std::optional<std::string>(const std::string& key, const std::string& value)> apply;
};

template <typename Record>
struct FieldEdit {
  const char* field;
  std::function<void(Record*)> edit;
};

// `edits` of a record that `read` decodes and `write` encodes.
template <typename Record, typename Read, typename Write>
std::vector<FieldDamage> DamagesOf(const std::vector<FieldEdit<Record>>& edits, Read read,
                                   Write write) {
  std::vector<FieldDamage> damages;
  for (const FieldEdit<Record>& edit : edits) {
    damages.push_back({edit.field,
                       [edit, read, write](const std::string& key,
                                           const std::string& value) -> std::optional<std::string> {
                         Record record;
                         if (!read(key, value, &record).ok()) return std::nullopt;
                         edit.edit(&record);
                         Result<std::string> encoded = write(record);
                         if (!encoded.ok() || *encoded == value) return std::nullopt;
                         return std::move(*encoded);
                       }});
  }
  return damages;
}

template <typename Record>
std::vector<FieldDamage> DamagesOf(const std::vector<FieldEdit<Record>>& edits) {
  const auto read = [](const std::string& key, const std::string& value, Record* record) {
    return ReadStored(key, value, record);
  };
  return DamagesOf(edits, read, [](const Record& record) { return Encode(record); });
}

inline void Turn(Eigen::Quaterniond* rotation) {
  *rotation = (*rotation * Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY())))
                  .normalized();
}

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

inline std::vector<FieldDamage> PairDamages() {
  using R = PairRow;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) { return r.is_neighbor ? Encode(r.neighbor) : Encode(r.pair); };
  const auto other = [](PairGeometry g) {
    return g == PairGeometry::kGeneral ? PairGeometry::kPlanar : PairGeometry::kGeneral;
  };
  const auto of_pair = [](std::function<void(PairRecord*)> edit) {
    return [edit](R* r) {
      if (!r->is_neighbor) edit(&r->pair);
    };
  };
  return DamagesOf<R>(
      {{"matchCount", [](R* r) { r->neighbor.match_count += 1; }},
       {"geometry of a direction",
        [=](R* r) { r->neighbor.geometry = other(r->neighbor.geometry); }},
       {"geometry", of_pair([=](PairRecord* p) { p->geometry = other(p->geometry); })},
       {"bFromA: rotation", of_pair([](PairRecord* p) { Turn(&p->b_from_a.rotation); })},
       {"bFromA: translation, turned", of_pair([](PairRecord* p) {
          p->b_from_a.translation = p->b_from_a.translation.unitOrthogonal().eval();
        })},
       {"bFromA: translation, turned round",
        of_pair([](PairRecord* p) { p->b_from_a.translation *= -1; })},
       {"bFromA: length of the translation",
        of_pair([](PairRecord* p) { p->b_from_a.translation *= 1.01; })},
       {"matches: one less", of_pair([](PairRecord* p) { p->matches.pop_back(); })},
       {"matches: b of one", of_pair([](PairRecord* p) {
          std::swap(p->matches[0].b, p->matches[p->matches.size() / 2].b);
        })},
       {"matches: b of one, twice",
        of_pair([](PairRecord* p) { p->matches[0].b = p->matches[1].b; })},
       {"matches: b of one, beyond all",
        of_pair([](PairRecord* p) { p->matches[0].b = 1'000'000; })},
       {"matches: a of the last, beyond all",
        of_pair([](PairRecord* p) { p->matches.back().a = 1'000'000; })}},
      read, write);
}

inline std::vector<FieldDamage> ReconstructionDamages() {
  using R = ReconstructionRecord;
  return DamagesOf<R>(
      {{"mergedInto",
        [](R* r) { r->merged_into = ReconstructionId(r->merged_into.valid() ? 0 : 9); }},
       {"mergedInto", [](R* r) { r->merged_into.value = 3 - r->id.value; }},
       {"mergedFromThisScale", [](R* r) { r->merged_from_this.scale *= 1.1; }},
       {"mergedFromThis: rotation", [](R* r) { Turn(&r->merged_from_this.rotation); }},
       {"mergedFromThis: translation", [](R* r) { r->merged_from_this.translation.x() += 0.1; }},
       {"imageCount", [](R* r) { r->image_count += 1; }},
       {"pointCount", [](R* r) { r->point_count += 1; }},
       {"observationCount", [](R* r) { r->observation_count += 1; }},
       {"reprojectionErrorPxSum", [](R* r) { r->reprojection_error_px_sum += 10; }},
       {"geometryVersion", [](R* r) { r->geometry_version += 1; }},
       {"pointsGeneration", [](R* r) { r->points_generation += 1; }},
       {"imagesAtAdjustment", [](R* r) { r->images_at_adjustment += 1; }}});
}

inline std::vector<FieldDamage> PoseDamages() {
  using R = PoseRecord;
  return DamagesOf<R>(
      {{"reconstruction", [](R* r) { r->reconstruction.value = 3 - r->reconstruction.value; }},
       {"reconstruction", [](R* r) { r->reconstruction.value = 77; }},
       {"camFromWorld: rotation", [](R* r) { Turn(&r->cam_from_world.rotation); }},
       {"camFromWorld: length of the rotation",
        [](R* r) { r->cam_from_world.rotation.coeffs() *= 1.0001; }},
       {"camFromWorld: translation", [](R* r) { r->cam_from_world.translation.y() += 0.01; }}});
}

inline std::vector<FieldDamage> ObservationsDamages() {
  using R = ObservationsEntry;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) {
    return Encode(std::span<const Observation>(r.observations));
  };
  return DamagesOf<R>(
      {{"rows: one less", [](R* r) { r->observations.pop_back(); }},
       {"rows: feature", [](R* r) { r->observations.back().feature += 1; }},
       {"rows: home", [](R* r) { r->observations[0].point.home.value += 1; }},
       {"rows: ordinal", [](R* r) { r->observations[0].point.ordinal += 1; }},
       {"rows: exchanged",
        [](R* r) { std::swap(r->observations[0].point, r->observations[1].point); }}},
      read, write);
}

inline std::vector<FieldDamage> PointsDamages() {
  using R = PointsEntry;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) { return Encode(r.block); };
  const auto of_first = [](std::function<void(PointRecord*)> edit) {
    return [edit](R* r) {
      if (!r->block.points.empty()) edit(&r->block.points.front());
    };
  };
  return DamagesOf<R>(
      {{"nextOrdinal", [](R* r) { r->block.next_ordinal += 1; }},
       {"ordinals",
        [](R* r) {
          r->block.points.back().id.ordinal += 1;
          r->block.next_ordinal += 1;
        }},
       {"positions", of_first([](PointRecord* p) { p->position.x() += 0.05; })},
       {"positions: exchanged",
        [](R* r) {
          if (r->block.points.size() > 1)
            std::swap(r->block.points[0].position, r->block.points[1].position);
        }},
       {"colors", of_first([](PointRecord* p) { p->rgb[0] ^= 8; })},
       {"errorsPx", of_first([](PointRecord* p) { p->error_px += 0.1f; })},
       {"trackLengths and trackElements: one more", of_first([](PointRecord* p) {
          p->track.push_back({ImageId(p->track.back().image.value + 1), 3});
        })},
       {"trackElements: image", of_first([](PointRecord* p) { p->track.back().image.value += 1; })},
       {"trackElements: feature", of_first([](PointRecord* p) { p->track.back().feature += 1; })},
       {"trackElements: feature beyond all",
        of_first([](PointRecord* p) { p->track.back().feature = 4'000'000'000u; })}},
      read, write);
}

inline std::vector<FieldDamage> WordsDamages() {
  using R = WordsEntry;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) { return EncodeWords(r.words); };
  return DamagesOf<R>({{"words: one less", [](R* r) { r->words.pop_back(); }},
                       {"words: one more", [](R* r) { r->words.push_back(r->words.back() + 1); }}},
                      read, write);
}

inline std::vector<FieldDamage> PostingsDamages() {
  using R = PostingsEntry;
  const auto read = [](auto& key, auto& value, R* r) { return ReadStored(key, value, r); };
  const auto write = [](const R& r) { return EncodeImages(r.images); };
  return DamagesOf<R>({{"images: one less", [](R* r) { r->images.pop_back(); }},
                       {"images: one more",
                        [](R* r) { r->images.push_back(ImageId(r->images.back().value + 1)); }}},
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

// Empty where values have no fields: photos, vocabularies and marks are bytes as a whole.
inline std::vector<FieldDamage> FieldDamagesOf(Family family) {
  switch (family) {
    case Family::kMeta:
      return StateDamages();
    case Family::kCameras:
      return CameraDamages();
    case Family::kNames:
      return IndexDamages(true);
    case Family::kHashes:
      return IndexDamages(false);
    case Family::kFeatures:
      return FeaturesDamages();
    case Family::kImages:
      return ImageDamages();
    case Family::kPairs:
      return PairDamages();
    case Family::kReconstructions:
      return ReconstructionDamages();
    case Family::kPoses:
      return PoseDamages();
    case Family::kObservations:
      return ObservationsDamages();
    case Family::kPoints:
      return PointsDamages();
    case Family::kWords:
      return WordsDamages();
    case Family::kPostings:
      return PostingsDamages();
    case Family::kJournal:
      return JournalDamages();
    default:
      return {};
  }
}

}  // namespace veduta
