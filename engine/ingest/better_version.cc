// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/better_version.h"

#include <algorithm>

#include "engine/camera/orientation.h"
#include "engine/camera/private_areas.h"
#include "engine/ingest/counterparts.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/retries.h"
#include "engine/journal/journal.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {
namespace {

std::string SizeText(const ImageRecord& image) {
  return std::to_string(image.width_px) + "x" + std::to_string(image.height_px);
}

// What people know the stored photo by, with what is told of the bytes of the larger copy. A copy
// that says nothing of where and when it was taken has lost that on its way.
ImageRecord ExchangedRecord(const ImageRecord& stored, const ImageRecord& better) {
  ImageRecord record = stored;
  record.photo = better.photo;
  record.camera = better.camera;
  record.width_px = better.width_px;
  record.height_px = better.height_px;
  record.orientation = better.orientation;
  record.size_bytes = better.size_bytes;
  record.feature_count = better.feature_count;
  record.media_type = better.media_type;
  if (better.gps) record.gps = better.gps;
  if (better.taken) record.taken = better.taken;
  return record;
}

uint32_t CountSeen(const MapImage& image, std::span<const FeatureMatch> counterparts) {
  return static_cast<uint32_t>(std::ranges::count_if(
      counterparts, [&](const FeatureMatch& match) { return image.points[match.a].valid(); }));
}

// The same camera's pose when its pixels are stored in another orientation.
Rigid3 TurnedPose(const Rigid3& cam_from_world, int orientation, int other_orientation) {
  const Eigen::Matrix3d turn =
      UprightCamFromStoredCam(other_orientation).transpose() * UprightCamFromStoredCam(orientation);
  return Rigid3{Eigen::Quaterniond(turn), Eigen::Vector3d::Zero()} * cam_from_world;
}

// False where too few points are left.
Result<bool> ExchangeInMap(const IngestParts& parts, const WriteScope& scope,
                           const ImageRecord& record, const ImageFeatures& stored,
                           const CameraModel& stored_camera, const BetterVersion& better) {
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  VEDUTA_RETURN_IF_ERROR(loader.LoadToUnplace(stored.id));
  const std::vector<FeatureMatch> counterparts =
      FindCounterparts({stored_camera, *stored.features, record.orientation},
                       {better.camera, *better.features.features, better.record.orientation});
  if (CountSeen(parts.map->image(stored.id), counterparts) < parts.options.mapper.observations_min)
    return false;
  MapImage with = UnplacedImage(better.features);
  with.id = stored.id;
  if (record.orientation != better.record.orientation) {
    parts.map->SetPose(stored.id, TurnedPose(parts.map->image(stored.id).cam_from_world,
                                             record.orientation, better.record.orientation));
  }
  parts.map->ExchangePicture(std::move(with), counterparts);
  VEDUTA_RETURN_IF_ERROR(WriteChangedLocally(*parts.map, *scope.base, scope.transaction.get()));
  return true;
}

// Its pairs are those that the larger copy has been verified with, but for those that somebody has
// forbidden of the stored photo. Returns the others' numbers.
Result<std::vector<ImageId>> ExchangePairs(const Snapshot& snapshot, ImageId stored,
                                           const BetterVersion& better, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> before, snapshot.ListNeighbors(stored));
  for (const PairNeighbor& neighbor : before) transaction->DeletePair(stored, neighbor.image);
  std::vector<ImageId> others;
  for (const PairRecord& pair : better.pairs) {
    const PairMatches matches = MatchesFrom(pair, better.record.id);
    VEDUTA_ASSIGN_OR_RETURN(
        const bool is_forbidden,
        snapshot.IsForbidden(ForbiddenKind::kPair, stored.value, matches.other.value));
    if (matches.other == stored || is_forbidden) continue;
    transaction->PutPair(RecordOf(matches, stored));
    others.push_back(matches.other);
  }
  return others;
}

// The posting lists never take a word of an image back, so that it has the words of both.
Status AddWords(const Snapshot& snapshot, ImageId stored, std::span<const WordId> words,
                const DatabaseState& state, Transaction* transaction) {
  const uint32_t generation = state.vocabulary_generation;
  if (generation == 0) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(std::vector<WordId> all, snapshot.GetWords(generation, stored));
  all.insert(all.end(), words.begin(), words.end());
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  transaction->PutWords(generation, stored, all);
  transaction->AddPostings(generation, all, stored);
  return Status::Ok();
}

// Surveyed points lie in the pixels of the upright photo.
Status ScaleSightings(const Snapshot& snapshot, const ImageRecord& stored,
                      const ImageRecord& better, Transaction* transaction) {
  const ImageSize size = UprightSize({better.width_px, better.height_px}, better.orientation),
                  before = UprightSize({stored.width_px, stored.height_px}, stored.orientation);
  const double across = static_cast<double>(size.width_px) / before.width_px,
               down = static_cast<double>(size.height_px) / before.height_px;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<GroundPoint> points, snapshot.ListGroundPoints());
  for (GroundPoint& point : points) {
    const auto sighting = std::ranges::find(point.sightings, stored.id, &GroundSighting::image);
    if (sighting == point.sightings.end()) continue;
    sighting->x_px = (sighting->x_px + 0.5) * across - 0.5;
    sighting->y_px = (sighting->y_px + 0.5) * down - 0.5;
    transaction->PutGroundPoint(point);
  }
  return Status::Ok();
}

// What is to be tried again: the image where it has no pose, and otherwise those of its neighbours
// that have none.
Status AppendTries(const IngestParts& parts, const Snapshot& snapshot, ImageId image, bool has_pose,
                   std::span<const ImageId> others, DatabaseState* state) {
  if (has_pose) {
    Placement placement;
    placement.placed = {image};
    return AppendRetries(*parts.map, snapshot, placement, others, state);
  }
  if (std::ranges::find(state->pending_propagation, image) == state->pending_propagation.end())
    state->pending_propagation.push_back(image);
  return Status::Ok();
}

}  // namespace

bool IsLarger(const ImageRecord& record, const ImageRecord& stored) {
  return uint64_t{record.width_px} * record.height_px >
         uint64_t{stored.width_px} * stored.height_px;
}

Result<bool> ShowsWhatIsFilled(const Snapshot& snapshot, const ImageRecord& record,
                               const ImageRecord& stored) {
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes before, snapshot.GetPhoto(stored.photo));
  if (ReadPrivateAreas(before.bytes()).empty()) return false;
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes after, snapshot.GetPhoto(record.photo));
  return ReadPrivateAreas(after.bytes()).empty();
}

Result<bool> TakeBetterVersion(const IngestParts& parts, const ImageRecord& stored,
                               const BetterVersion& better, const std::string& actor,
                               DatabaseState state, WriteScope scope) {
  Transaction* const transaction = scope.transaction.get();
  const Snapshot& base = *scope.base;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, base.FindPose(stored.id));
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, base.GetCamera(stored.camera));
  VEDUTA_ASSIGN_OR_RETURN(const auto features, parts.features->Get(base, stored.id));
  if (pose) {
    VEDUTA_ASSIGN_OR_RETURN(const bool is_exchanged,
                            ExchangeInMap(parts, scope, stored, *features, camera.model, better));
    if (!is_exchanged) return false;
  }
  const ImageRecord record = ExchangedRecord(stored, better.record);
  transaction->DeletePhoto(stored.photo);
  transaction->DeleteOriginal(stored.id);
  if (better.original) transaction->SealOriginal(stored.id, *better.original);
  transaction->PutImage(record);
  transaction->KeepFeatures(record.photo, better.extracted);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> others,
                          ExchangePairs(base, stored.id, better, transaction));
  VEDUTA_RETURN_IF_ERROR(AddWords(base, stored.id, better.words, state, transaction));
  VEDUTA_RETURN_IF_ERROR(ScaleSightings(base, stored, better.record, transaction));
  VEDUTA_RETURN_IF_ERROR(AppendTries(parts, base, stored.id, pose.has_value(), others, &state));
  state.removed_bytes_left = true;
  AppendJournal({0,
                 0,
                 actor,
                 "replace",
                 stored.id,
                 {},
                 stored.photo.Hex() + " of " + SizeText(stored) + " by " + record.photo.Hex() +
                     " of " + SizeText(record)},
                &state, transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  parts.features->Forget(stored.id, stored.photo);
  return true;
}

}  // namespace veduta
