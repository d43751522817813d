// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/ingest.h"

#include <algorithm>
#include <ctime>
#include <map>

#include "engine/journal/journal.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

std::string NeighborDetail(const NeighborSearch& search) {
  if (search.tried_count == 0) return "the database holds no photo to compare with yet";
  std::string text =
      "none of " + std::to_string(search.tried_count) + " candidates passed the geometric check";
  if (search.best_inlier_count > 0) {
    text += "; the best, image " + std::to_string(search.best_failed.value) + ", has " +
            std::to_string(search.best_inlier_count) + " consistent matches";
  }
  return text;
}

// Adds what a second search found; of a pair that both have verified, the one with more matches is
// kept.
void Join(ImageId image, NeighborSearch found, NeighborSearch* search) {
  std::map<ImageId, PairRecord> pairs;
  for (std::vector<PairRecord>* some : {&search->pairs, &found.pairs}) {
    for (PairRecord& pair : *some) {
      PairRecord& best = pairs[pair.a == image ? pair.b : pair.a];
      if (pair.matches.size() > best.matches.size()) best = std::move(pair);
    }
  }
  search->pairs.clear();
  for (auto& [other, pair] : pairs) search->pairs.push_back(std::move(pair));
  if (search->tried_count == 0)
    search->tried_count = found.tried_count;  // the second tries among the same
  if (found.best_inlier_count >= search->best_inlier_count && found.best_failed.valid()) {
    search->best_inlier_count = found.best_inlier_count;
    search->best_failed = found.best_failed;
  }
  search->promising = std::move(found.promising);
}

void CountTimes(const PreparedPhoto& photo, StepTimes* times) {
  times->decode_ms = photo.decode_ms;
  times->undistort_ms = photo.undistort_ms;
  times->features_ms = photo.features_ms;
}

}  // namespace

void Journal(std::string actor, std::string action, ImageId image, ReconstructionId reconstruction,
             std::string detail, DatabaseState* state, Transaction* transaction) {
  AppendJournal(
      {0, 0, std::move(actor), std::move(action), image, reconstruction, std::move(detail)}, state,
      transaction);
}

void Ingest::TrimMap() {
  if (map_.images().size() > options_.map_images_max) map_.Clear();
}

Result<AddOutcome> Ingest::StoreRejection(const PreparedPhoto& photo, const Snapshot& snapshot,
                                          ImageRecord record) {
  AddOutcome outcome;
  outcome.name = photo.name;
  outcome.reason = record.reason = photo.reason;
  outcome.detail = record.detail = photo.detail;
  outcome.verdict = record.verdict = Verdict::kRejected;
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot.GetState());
  if (!record.id.valid()) record.id = ImageId(state.next_image++);
  outcome.id = record.id;
  const std::unique_ptr<Transaction> transaction = database_->BeginTransaction();
  transaction->PutImage(record);
  Journal(record.contributor, "add", record.id, {}, "rejected: " + record.detail, &state,
          transaction.get());
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  return outcome;
}

Status Ingest::Search(const ImageFeatures& image, std::span<const RankedImage> candidates,
                      const NeighborOptions& options, uint64_t seed, MapLoader* loader,
                      NeighborSearch* search, StepTimes* times) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(NeighborSearch found, FindNeighbors(image, candidates, seed, loader, map_,
                                                              features_, pool_, options));
  const double search_ms = watch.LapMs(),
               pair_ms = std::max(found.match_ms + found.verify_ms, 1e-9);
  times->match_ms += search_ms * found.match_ms / pair_ms;
  times->verify_ms += search_ms * found.verify_ms / pair_ms;
  Join(image.id, std::move(found), search);
  return Status::Ok();
}

Status Ingest::SearchThoroughly(const ImageFeatures& wide, uint64_t seed, MapLoader* loader,
                                NeighborSearch* search, StepTimes* times) {
  NeighborOptions options = options_.neighbors;
  options.extended_count_max = 0;
  const std::vector<RankedImage> promising = std::move(search->promising);
  const size_t count = std::min<size_t>(promising.size(), options_.thorough_pairs_max);
  return Search(wide, {promising.data(), count}, options, MixSeed(seed, 3), loader, search, times);
}

Result<Placement> Ingest::Place(const ImageFeatures& image, const NeighborSearch& search,
                                const DatabaseState& state, uint64_t seed, MapLoader* loader,
                                StepTimes* times) {
  if (search.pairs.empty()) {
    Placement postponed;
    postponed.reason =
        search.tried_count == 0 ? Reason::kNoCandidates : Reason::kNoVerifiedNeighbor;
    postponed.detail = NeighborDetail(search);
    postponed.inlier_count = search.best_inlier_count;
    return postponed;
  }
  std::vector<PairMatches> pairs;
  for (const PairRecord& pair : search.pairs) pairs.push_back(MatchesFrom(pair, image.id));
  Mapper mapper(loader, &map_, pool_, options_.mapper);
  Result<Placement> placed =
      mapper.Place(image, pairs, ReconstructionId(state.next_reconstruction), seed);
  if (!placed.ok()) {
    map_.Clear();
    return placed.status();
  }
  times->map_ms += placed->map_ms;
  times->adjust_ms += placed->adjust_ms;
  return placed;
}

Result<Placement> Ingest::Locate(const ImageFeatures& image, const CameraModel& camera,
                                 std::span<const RankedImage> candidates,
                                 const DatabaseState& state, uint64_t seed, MapLoader* loader,
                                 NeighborSearch* search, StepTimes* times) {
  VEDUTA_RETURN_IF_ERROR(
      Search(image, candidates, options_.neighbors, seed, loader, search, times));
  const bool is_ample = std::any_of(
      search->pairs.begin(), search->pairs.end(),
      [&](const PairRecord& pair) { return pair.matches.size() >= options_.ample_match_count; });
  if (is_ample || candidates.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(Placement placement, Place(image, *search, state, seed, loader, times));
    if (placement.verdict != Verdict::kPostponed || candidates.empty()) return placement;
  }
  VEDUTA_ASSIGN_OR_RETURN(const auto wide, ImageFeatures::Make(image.id, camera, image.features,
                                                               options_.thorough_count_max));
  VEDUTA_RETURN_IF_ERROR(SearchThoroughly(*wide, seed, loader, search, times));
  return Place(*wide, *search, state, seed, loader, times);
}

Result<AddOutcome> Ingest::Apply(PreparedPhoto photo, const CameraRecord& camera,
                                 const std::string& contributor) {
  Stopwatch total, watch;
  AddOutcome outcome;
  outcome.name = photo.name;
  const std::shared_ptr<const Snapshot> snapshot = database_->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> same,
                          snapshot->FindImageByPhoto(photo.hash));
  if (same) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord stored, snapshot->GetImage(*same));
    outcome.id = *same;
    outcome.duplicate = true;
    outcome.verdict = stored.verdict;
    outcome.reason = stored.reason;
    outcome.detail = "the same bytes are stored as " + stored.name;
    return outcome;
  }

  ImageRecord record;
  record.name = photo.name;
  record.photo = photo.hash;
  record.camera = camera.id;
  record.width_px = photo.width_px;
  record.height_px = photo.height_px;
  record.size_bytes = photo.size_bytes;
  record.feature_count = static_cast<uint32_t>(photo.features.size());
  record.contributor = contributor;
  record.time_unix_s = std::time(nullptr);
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> namesake,
                          snapshot->FindImageByName(photo.name));
  if (namesake) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord stored, snapshot->GetImage(*namesake));
    if (stored.verdict != Verdict::kRejected) {
      if (photo.reason == Reason::kNone)
        VEDUTA_RETURN_IF_ERROR(database_->DropPhotoAhead(photo.hash));
      outcome.reason = Reason::kNameTaken;
      outcome.detail = "another photo is stored under this name; rename the file to add it";
      return outcome;
    }
    record.id = *namesake;  // a rejected photo may be sent again, mended
  }
  if (photo.reason != Reason::kNone) return StoreRejection(photo, *snapshot, std::move(record));

  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot->GetState());
  if (!record.id.valid()) record.id = ImageId(state.next_image++);
  const uint64_t seed = photo.hash.Seed();
  TrimMap();
  MapLoader loader(snapshot, features_, &map_);
  const auto stored_features = std::make_shared<const Features>(std::move(photo.features));
  VEDUTA_ASSIGN_OR_RETURN(
      const auto image,
      ImageFeatures::Make(record.id, camera.model, stored_features, options_.matched_count_max));

  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words,
                          retrieval_->Words(*snapshot, *stored_features));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<RankedImage> candidates,
                          retrieval_->Candidates(*snapshot, *stored_features));
  outcome.times.retrieve_ms = watch.LapMs();
  NeighborSearch search;
  VEDUTA_ASSIGN_OR_RETURN(
      const Placement placement,
      Locate(*image, camera.model, candidates, state, seed, &loader, &search, &outcome.times));
  outcome.pairs_tried = search.tried_count;
  outcome.neighbor_count = static_cast<uint32_t>(search.pairs.size());
  watch.LapMs();
  record.verdict = placement.verdict;
  record.reason = placement.reason;
  record.detail = placement.detail;

  const std::unique_ptr<Transaction> transaction = database_->BeginTransaction();
  ++state.retrievable_image_count;
  transaction->PutImage(record);
  for (const PairRecord& pair : search.pairs) transaction->PutPair(pair);
  if (state.vocabulary_generation != 0) {
    transaction->PutWords(state.vocabulary_generation, record.id, words);
    transaction->AddPostings(state.vocabulary_generation, words, record.id);
  }
  Status written = WritePlacement(*snapshot, placement, &state, transaction.get());
  // Neighbours that wait may have waited for this photo's pairs alone.
  if (written.ok() && !placement.placed.empty()) {
    for (const PairRecord& pair : search.pairs) {
      const ImageId other = pair.a == record.id ? pair.b : pair.a;
      const auto& retries = state.pending_propagation;
      if (!map_.HasImage(other) &&
          std::find(retries.begin(), retries.end(), other) == retries.end()) {
        state.pending_propagation.push_back(other);
      }
    }
  }
  Journal(contributor, "add", record.id, placement.reconstruction, placement.detail, &state,
          transaction.get());
  transaction->PutState(state);
  if (written.ok()) written = transaction->Commit();
  if (!written.ok()) {
    map_.Clear();
    return written;
  }
  map_.ClearChanges();
  features_->Put(image);

  outcome.id = record.id;
  outcome.verdict = placement.verdict;
  outcome.reason = placement.reason;
  outcome.detail = placement.detail;
  outcome.reconstruction = placement.reconstruction;
  outcome.inlier_count = placement.inlier_count;
  if (!placement.placed.empty())
    outcome.propagated.assign(placement.placed.begin() + 1, placement.placed.end());
  CountTimes(photo, &outcome.times);
  outcome.times.commit_ms = watch.LapMs();
  outcome.times.total_ms = total.LapMs() + photo.decode_ms + photo.undistort_ms + photo.features_ms;
  return outcome;
}

Status Ingest::AppendRetries(const Snapshot& snapshot, std::span<const ImageId> placed,
                             DatabaseState* state) {
  for (const ImageId id : placed) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, snapshot.ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) {
      auto& retries = state->pending_propagation;
      if (map_.HasImage(neighbor.image)) continue;
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose,
                              snapshot.FindPose(neighbor.image));
      if (!pose && std::find(retries.begin(), retries.end(), neighbor.image) == retries.end()) {
        retries.push_back(neighbor.image);
      }
    }
  }
  return Status::Ok();
}

Status Ingest::WriteChanges(const Snapshot& snapshot, const Placement& placement,
                            Transaction* transaction) {
  std::map<ReconstructionId, ReconstructionRecord> records;
  const auto record_of = [&](ReconstructionId id) -> Result<ReconstructionRecord*> {
    if (!records.contains(id)) {
      if (id == placement.founded) {
        records[id].id = id;
        records[id].points_generation = 1;
        records[id].image_count = records[id].images_at_adjustment =
            static_cast<uint32_t>(placement.placed.size());
      } else {
        VEDUTA_ASSIGN_OR_RETURN(records[id], snapshot.GetReconstruction(id));
      }
    }
    return &records[id];
  };
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord* const into, record_of(placement.reconstruction));
  if (!placement.founded.valid()) {
    // The photo was placed in one that was then perhaps merged away; the sum is the same.
    into->image_count += 1;
  }
  for (const Merge& merge : placement.merges) {
    VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord* const from, record_of(merge.from));
    into->image_count += from->image_count;
    into->point_count += from->point_count;
    into->observation_count += from->observation_count;
    into->reprojection_error_px_sum += from->reprojection_error_px_sum;
    into->images_at_adjustment = 0;  // all of it is due
    if (merge.from != placement.founded)
      transaction->DeletePointBlocks(merge.from, from->points_generation);
    from->merged_into = into->id;
    from->merged_from_this = merge.into_from;
    from->image_count = 0;
    from->point_count = from->observation_count = 0;
    from->reprojection_error_px_sum = 0;
    ++from->geometry_version;
  }
  for (const auto& [id, change] : map_.changes().counts) {
    const bool merged_away = std::any_of(placement.merges.begin(), placement.merges.end(),
                                         [&, id = id](const Merge& m) { return m.from == id; });
    VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord* const record,
                            record_of(merged_away ? placement.reconstruction : id));
    record->point_count += change.points;
    record->observation_count += change.observations;
    record->reprojection_error_px_sum += change.reprojection_error_px_sum;
    ++record->geometry_version;
  }
  for (const ImageId id : map_.changes().poses) {
    const MapImage& image = map_.image(id);
    transaction->PutPose({id, image.reconstruction, image.cam_from_world});
  }
  for (const ImageId id : map_.changes().observations)
    transaction->PutObservations(id, ObservationsOf(map_.image(id)));
  for (const ImageId home : map_.changes().blocks) {
    VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord* const record,
                            record_of(map_.image(home).reconstruction));
    transaction->PutPointBlock(record->id, record->points_generation, map_.StoredBlock(home));
  }
  for (const auto& [id, record] : records) transaction->PutReconstruction(record);
  return Status::Ok();
}

Status Ingest::WritePlacement(const Snapshot& snapshot, const Placement& placement,
                              DatabaseState* state, Transaction* transaction) {
  if (placement.verdict == Verdict::kPostponed) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(WriteChanges(snapshot, placement, transaction));
  if (placement.founded.valid()) {
    ++state->next_reconstruction;
    // The others of the triple were postponed until now.
    for (size_t i = 1; i < placement.placed.size(); ++i) {
      VEDUTA_ASSIGN_OR_RETURN(ImageRecord member, snapshot.GetImage(placement.placed[i]));
      member.verdict = Verdict::kFounded;
      member.reason = Reason::kGoodTriple;
      member.detail = "founded with image " + std::to_string(placement.placed.front().value);
      transaction->PutImage(member);
    }
  }
  for (const Merge& merge : placement.merges) {
    Journal("veduta", "merge", {}, placement.reconstruction,
            "reconstruction " + std::to_string(merge.from.value) + " by " +
                std::to_string(merge.common_point_count) + " common points",
            state, transaction);
  }
  return AppendRetries(snapshot, placement.placed, state);
}

Result<std::vector<ImageId>> Ingest::RetryNext(const DatabaseState& old_state) {
  const std::shared_ptr<const Snapshot> snapshot = database_->GetSnapshot();
  DatabaseState state = old_state;
  const ImageId id = state.pending_propagation.front();
  state.pending_propagation.erase(state.pending_propagation.begin());
  TrimMap();
  MapLoader loader(snapshot, features_, &map_);
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot->FindPose(id));
  Placement placement;
  const std::unique_ptr<Transaction> transaction = database_->BeginTransaction();
  if (!pose) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord record, snapshot->GetImage(id));
    VEDUTA_ASSIGN_OR_RETURN(const auto known, features_->Get(*snapshot, id));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot->GetCamera(record.camera));
    // What waits is hard to place: by more features, as when it came.
    VEDUTA_ASSIGN_OR_RETURN(
        const auto features,
        ImageFeatures::Make(id, camera.model, known->features, options_.thorough_count_max));
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, snapshot->ListNeighbors(id));
    std::vector<PairMatches> pairs;
    for (const PairNeighbor& neighbor : neighbors) {
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord pair, snapshot->GetPair(id, neighbor.image));
      pairs.push_back(MatchesFrom(pair, id));
    }
    Mapper mapper(&loader, &map_, pool_, options_.mapper);
    VEDUTA_ASSIGN_OR_RETURN(
        placement, mapper.Place(*features, pairs, ReconstructionId(state.next_reconstruction),
                                MixSeed(record.photo.Seed(), 1)));
    record.reason =
        placement.reason == Reason::kRegistered ? Reason::kPropagated : placement.reason;
    record.verdict = placement.verdict;
    record.detail = placement.detail;
    transaction->PutImage(record);
    VEDUTA_RETURN_IF_ERROR(WritePlacement(*snapshot, placement, &state, transaction.get()));
    if (!placement.placed.empty()) {
      Journal("veduta", "propagate", id, placement.reconstruction, placement.detail, &state,
              transaction.get());
    }
  }
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  map_.ClearChanges();
  return placement.placed;
}

bool Ingest::IsAdjustmentDue(const ReconstructionRecord& record) const {
  if (record.merged_into.valid()) return false;
  const double step = std::max<double>(
      options_.schedule.views_step, options_.schedule.growth_share * record.images_at_adjustment);
  return record.image_count >= record.images_at_adjustment + step ||
         (record.images_at_adjustment == 0 && record.image_count > 0);
}

Result<bool> Ingest::AdjustNext() {
  const std::shared_ptr<const Snapshot> snapshot = database_->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> all,
                          snapshot->ListReconstructions());
  const auto due = std::find_if(all.begin(), all.end(),
                                [&](const ReconstructionRecord& r) { return IsAdjustmentDue(r); });
  if (due == all.end()) return false;
  MapLoader loader(snapshot, features_, &map_);
  Mapper mapper(&loader, &map_, pool_, options_.mapper);
  VEDUTA_RETURN_IF_ERROR(mapper.AdjustReconstruction(due->id));

  // All points move, so all blocks are written, ahead of the commit, as a new generation that the
  // commit switches to.
  ReconstructionRecord record = *due;
  record.points_generation = due->points_generation + 1;
  const CountChange change = map_.changes().counts.contains(record.id)
                                 ? map_.changes().counts.at(record.id)
                                 : CountChange{};
  record.point_count += change.points;
  record.observation_count += change.observations;
  record.reprojection_error_px_sum = 0;
  record.images_at_adjustment = record.image_count;
  ++record.geometry_version;
  std::vector<ImageId> members;
  for (const auto& [id, image] : map_.images()) {
    if (image.reconstruction == record.id) members.push_back(id);
  }
  for (const ImageId home : members) {
    const PointBlock block = map_.StoredBlock(home);
    for (const PointRecord& point : block.points) {
      record.reprojection_error_px_sum +=
          static_cast<double>(point.error_px) * static_cast<double>(point.track.size());
    }
    VEDUTA_RETURN_IF_ERROR(
        database_->WritePointBlocksAhead(record.id, record.points_generation, {&block, 1}));
  }
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot->GetState());
  const std::unique_ptr<Transaction> transaction = database_->BeginTransaction();
  for (const ImageId id : map_.changes().poses)
    transaction->PutPose({id, record.id, map_.image(id).cam_from_world});
  for (const ImageId id : map_.changes().observations)
    transaction->PutObservations(id, ObservationsOf(map_.image(id)));
  transaction->DeletePointBlocks(record.id, due->points_generation);
  transaction->PutReconstruction(record);
  Journal("veduta", "adjust", {}, record.id, std::to_string(record.image_count) + " images", &state,
          transaction.get());
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  map_.ClearChanges();
  return true;
}

Result<std::vector<ImageId>> Ingest::FinishDue() {
  std::vector<ImageId> placed;
  const auto failed = [this](Status status) {
    map_.Clear();
    return status;
  };
  for (;;) {
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, database_->GetSnapshot()->GetState());
    if (!state.pending_propagation.empty()) {
      Result<std::vector<ImageId>> retried = RetryNext(state);
      if (!retried.ok()) return failed(retried.status());
      placed.insert(placed.end(), retried->begin(), retried->end());
      continue;
    }
    const Result<bool> adjusted = AdjustNext();
    if (!adjusted.ok()) return failed(adjusted.status());
    if (*adjusted) continue;
    if (!retrieval_->IsTrainingDue(state)) return placed;
    VEDUTA_RETURN_IF_ERROR(retrieval_->Train(database_, pool_));
  }
}

}  // namespace veduta
