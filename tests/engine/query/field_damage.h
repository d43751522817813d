// SPDX-License-Identifier: Apache-2.0
#pragma once
// Every field of every record, each with a change to another value that looks as legal.

#include <functional>
#include <string>
#include <vector>

#include "storage/records/border_record.h"
#include "storage/records/pair_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/submap_record.h"
#include "storage/records/vocabulary_record.h"
#include "tests/engine/query/field_edit.h"
#include "tests/engine/query/hypothesis_damage.h"
#include "tests/engine/query/image_damage.h"

namespace veduta {

inline void Turn(Eigen::Quaterniond* rotation) {
  *rotation = (*rotation * Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY())))
                  .normalized();
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
       {"focalAPx", of_pair([](PairRecord* p) { p->lens_a.focal_px *= 1.2; })},
       {"focalBPx", of_pair([](PairRecord* p) { p->lens_b.focal_px *= 1.2; })},
       {"k1A", of_pair([](PairRecord* p) { p->lens_a.k1 += 0.3; })},
       {"k2A", of_pair([](PairRecord* p) { p->lens_a.k2 += 0.9; })},
       {"k1B", of_pair([](PairRecord* p) { p->lens_b.k1 += 0.3; })},
       {"k2B", of_pair([](PairRecord* p) { p->lens_b.k2 += 0.9; })},
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
       {"imagesAtAdjustment", [](R* r) { r->images_at_adjustment += 1; }},
       {"dissolved", [](R* r) { r->is_dissolved = !r->is_dissolved; }}});
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

inline std::vector<FieldDamage> SubmapDamages() {
  using R = SubmapRecord;
  const auto read = [](const std::string& key, const std::string& value, R* record) {
    VEDUTA_RETURN_IF_ERROR(ParseSubmapKey(key, record));
    return Decode(value, record);
  };
  return DamagesOf<R>(
      {{"submap: reconstruction", [](R* r) { r->reconstruction.value += 1; }},
       {"submap: images, one less",
        [](R* r) {
          r->images.pop_back();
          r->images_at_adjustment = 0;
        }},
       {"submap: images, beyond all", [](R* r) { r->images.push_back(ImageId(999)); }},
       {"submap: imagesAtAdjustment", [](R* r) { r->images_at_adjustment -= 1; }},
       {"submap: motion", [](R* r) { r->motion = Sim3(); }}},
      read, [](const R& record) { return Encode(record); });
}

inline std::vector<FieldDamage> BorderDamages() {
  using R = SubmapBorder;
  const auto read = [](const std::string& key, const std::string& value, R* record) {
    VEDUTA_RETURN_IF_ERROR(ParseBorderKey(key, record));
    return Decode(value, record);
  };
  return DamagesOf<R>({{"border: views", [](R* r) { r->views.clear(); }},
                       {"border: evidence", [](R* r) { r->evidence.clear(); }},
                       {"border: fragments", [](R* r) { r->fragments.clear(); }}},
                      read, [](const R& record) { return Encode(record); });
}

// Empty where values have no fields: photos, vocabularies and marks are bytes as a whole.
inline std::vector<FieldDamage> FieldDamagesOf(Family family) {
  switch (family) {
    case Family::kMeta: {
      std::vector<FieldDamage> damages = StateDamages();
      for (FieldDamage& damage : HypothesisDamages()) damages.push_back(std::move(damage));
      for (FieldDamage& damage : SubmapDamages()) damages.push_back(std::move(damage));
      for (FieldDamage& damage : BorderDamages()) damages.push_back(std::move(damage));
      return damages;
    }
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
