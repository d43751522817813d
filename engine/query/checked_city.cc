// SPDX-License-Identifier: Apache-2.0
#include "engine/query/checked_city.h"

#include <cstring>

#include "engine/photo/carried_features.h"
#include "engine/query/stored_records.h"
#include "storage/records/border_record.h"
#include "storage/records/earth_record.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/hidden_record.h"
#include "storage/records/hypothesis_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/report_record.h"
#include "storage/records/sealed_record.h"
#include "storage/records/state_record.h"
#include "storage/records/submap_record.h"
#include "storage/records/token_record.h"
#include "storage/records/token_use_record.h"

namespace veduta {
namespace {

// What people have forbidden, hidden or reported, a hypothesis, a submap, its border, a surveyed
// point, a token, what was used of one, or who has an original that was sealed.
Status LoadFact(std::string_view key, std::string_view value, CheckedCity* city) {
  if (key.starts_with(kHypothesisPrefix)) {
    HypothesisRecord hypothesis;
    VEDUTA_RETURN_IF_ERROR(ParseHypothesisKey(key, &hypothesis));
    VEDUTA_RETURN_IF_ERROR(Decode(value, &hypothesis));
    city->hypotheses.push_back(std::move(hypothesis));
    return Status::Ok();
  }
  if (key.starts_with(kBorderPrefix)) {
    SubmapBorder border;
    VEDUTA_RETURN_IF_ERROR(ParseBorderKey(key, &border));
    VEDUTA_RETURN_IF_ERROR(Decode(value, &border));
    city->borders.insert(border.id);
    return Status::Ok();
  }
  if (key.starts_with(kSubmapPrefix)) {
    SubmapRecord submap;
    VEDUTA_RETURN_IF_ERROR(ParseSubmapKey(key, &submap));
    VEDUTA_RETURN_IF_ERROR(Decode(value, &submap));
    city->submaps.push_back(std::move(submap));
    return Status::Ok();
  }
  if (key.starts_with(kGroundPointPrefix)) {
    GroundPoint point;
    VEDUTA_RETURN_IF_ERROR(ParseGroundPointKey(key, &point));
    VEDUTA_RETURN_IF_ERROR(Decode(value, &point));
    city->ground_points.push_back(std::move(point));
    return Status::Ok();
  }
  if (key.starts_with(kSealedPrefix)) {
    ContentHash original;
    if (!ParseSealedKey(key, &original)) return Status::Corruption("a key of wrong length");
    return DecodeU32(value, &city->sealed[original].value);
  }
  if (key.starts_with(kHiddenPrefix)) {
    HiddenRecord hidden;
    VEDUTA_RETURN_IF_ERROR(ParseHiddenKey(key, &hidden));
    return Decode(value, &hidden);
  }
  if (key.starts_with(kReportPrefix)) {
    ReportRecord report;
    VEDUTA_RETURN_IF_ERROR(ParseReportKey(key, &report));
    return Decode(value, &report);
  }
  if (key.starts_with(kTokenUsePrefix)) {
    TokenUse use;
    VEDUTA_RETURN_IF_ERROR(ParseTokenUseKey(key, &use));
    return Decode(value, &use);
  }
  if (key.starts_with(kTokenPrefix)) {
    TokenRecord token;
    VEDUTA_RETURN_IF_ERROR(ParseTokenKey(key, &token));
    return Decode(value, &token);
  }
  ForbiddenRecord forbidden;
  VEDUTA_RETURN_IF_ERROR(ParseForbiddenKey(key, &forbidden));
  VEDUTA_RETURN_IF_ERROR(Decode(value, &forbidden));
  city->forbidden.push_back(std::move(forbidden));
  return Status::Ok();
}

// The state, the number of the format, and the facts.
Status LoadMeta(CheckedCity* city, Violations* violations) {
  bool has_state = false, has_format = false;
  VEDUTA_RETURN_IF_ERROR(WalkStored(
      city->snapshot, Family::kMeta, violations, [&](std::string_view key, std::string_view value) {
        if (key == kFormatKey) {
          uint32_t format = 0;
          if (value.size() == sizeof(format)) std::memcpy(&format, value.data(), sizeof(format));
          has_format = format == kFormatVersion;
          return;
        }
        const bool is_state = key == kStateKey;
        const Status read = is_state ? Decode(value, &city->state) : LoadFact(key, value, city);
        has_state = has_state || (is_state && read.ok());
        if (!read.ok()) violations->Add(PlaceOf(Family::kMeta, key) + ": " + read.message());
      }));
  violations->Expect(has_format, "the number of the format is missing or not the program's");
  violations->Expect(has_state, "there is no state that can be read");
  return Status::Ok();
}

Status LoadMarks(CheckedCity* city, Violations* violations) {
  return WalkRecords<WriteAheadMark>(
      city->snapshot, Family::kQueue, violations, [&](const WriteAheadMark& mark) {
        switch (mark.kind) {
          case MarkKind::kPhoto:
            city->photos_ahead.insert(mark.photo);
            break;
          case MarkKind::kPointBlocks:
            city->points_ahead.insert({mark.reconstruction, mark.generation});
            break;
          case MarkKind::kVocabulary:
            city->vocabularies_ahead.insert(mark.generation);
            break;
        }
      });
}

}  // namespace

bool CheckedCity::HasFeatures(ImageId id) const {
  const auto found = images.find(id);
  return found != images.end() && found->second.verdict != Verdict::kRejected;
}

uint32_t CheckedCity::FeatureCount(ImageId id) const {
  return HasFeatures(id) ? images.at(id).feature_count : 0;
}

std::shared_ptr<const CheckedCity::Eye> CheckedCity::EyeOf(ImageId id) const {
  if (!HasFeatures(id)) return nullptr;
  if (std::shared_ptr<const Eye> kept = eyes_.Find(id)) return kept;
  const ImageRecord& image = images.at(id);
  const auto camera = cameras.find(image.camera);
  Result<Features> features = snapshot.GetFeatures(image.photo);
  if (camera == cameras.end() || !features.ok()) return nullptr;
  auto eye = std::make_shared<Eye>();
  eye->camera = Pinhole(camera->second.model);
  eye->extraction = camera->second.extraction_model();
  const auto places = [&] {
    KeypointPlaces all;
    all.reserve(features->size());
    for (const Keypoint& k : features->keypoints) all.emplace_back(k.x_px, k.y_px);
    return all;
  };
  if (camera->second.refined_from) eye->extracted = places();
  CarryKeypoints(camera->second, features->keypoints);
  eye->keypoints = places();
  eyes_.Put(
      id, eye,
      sizeof(Eye) + (eye->keypoints.size() + eye->extracted.size()) * sizeof(Eigen::Vector2f));
  return eye;
}

Status LoadCity(CheckedCity* city, Violations* violations) {
  VEDUTA_RETURN_IF_ERROR(LoadMeta(city, violations));
  VEDUTA_RETURN_IF_ERROR(LoadMarks(city, violations));
  const Snapshot& snapshot = city->snapshot;
  VEDUTA_RETURN_IF_ERROR(
      WalkRecords<CameraRecord>(snapshot, Family::kCameras, violations,
                                [&](const CameraRecord& r) { city->cameras[r.id] = r; }));
  VEDUTA_RETURN_IF_ERROR(
      WalkRecords<ImageRecord>(snapshot, Family::kImages, violations,
                               [&](const ImageRecord& r) { city->images[r.id] = r; }));
  VEDUTA_RETURN_IF_ERROR(WalkRecords<ReconstructionRecord>(
      snapshot, Family::kReconstructions, violations,
      [&](const ReconstructionRecord& r) { city->reconstructions[r.id] = r; }));
  return WalkRecords<PoseRecord>(snapshot, Family::kPoses, violations,
                                 [&](const PoseRecord& r) { city->poses[r.image] = r; });
}

}  // namespace veduta
