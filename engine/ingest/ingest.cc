// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/ingest.h"

#include <algorithm>
#include <cstdio>

#include "engine/ingest/believed_pose.h"
#include "engine/ingest/better_version.h"
#include "engine/ingest/double_finder.h"
#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/georeferencing.h"
#include "engine/ingest/judging.h"
#include "engine/ingest/photo_locator.h"
#include "engine/ingest/photo_placement.h"
#include "engine/ingest/photo_removal.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/relaxation_steps.h"
#include "engine/ingest/submap_steps.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/camera_entry.h"
#include "engine/journal/journal.h"
#include "engine/photo/camera_group.h"
#include "engine/photo/carried_features.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

void JournalAdded(const ImageRecord& record, ReconstructionId reconstruction, std::string detail,
                  DatabaseState* state, Transaction* transaction) {
  JournalRecord entry;
  entry.actor = record.contributor;
  entry.action = "add";
  entry.image = record.id;
  entry.reconstruction = reconstruction;
  entry.detail = std::move(detail);
  AppendJournal(std::move(entry), state, transaction);
}

// Stores the photo's camera where it is new, and returns its name then.
Result<std::string> PutCameraIfNew(const CameraRecord& camera, const WriteScope& scope,
                                   DatabaseState* state, ImageRecord* record) {
  if (camera.id.valid()) return std::string();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> known, scope.base->ListCameras());
  CameraRecord added = camera;
  added.id = record->camera = CameraId(state->next_camera++);
  if (added.name.empty()) added.name = "estimated " + std::to_string(added.id.value);
  added.name = NumberedName(added.name, [&](const std::string& name) {
    return std::ranges::count(known, name, &CameraRecord::name) > 0;
  });
  PutNewCamera(added, state, scope.transaction.get());
  return added.name;
}

// Of a photo that waits for the pose that comes with a model.
constexpr const char* kAwaitsPoseDetail =
    "its pose is to come with a model: if the import was broken off, run it again";

// Adds those of the named photos that are stored and not among the candidates yet.
Status AddPartners(const Snapshot& snapshot, const AwaitedPose& awaited,
                   const std::string& contributor, std::vector<RankedImage>* candidates) {
  for (const std::string& name : awaited.seen_with) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> partner,
                            snapshot.FindImageByName(name, contributor));
    if (!partner ||
        std::ranges::find(*candidates, *partner, &RankedImage::image) != candidates->end())
      continue;
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(*partner));
    if (image.verdict != Verdict::kRejected) candidates->push_back({*partner, 0});
  }
  return Status::Ok();
}

AddOutcome DuplicateOf(const ImageRecord& stored, const PreparedPhoto& photo) {
  AddOutcome outcome;
  outcome.name = photo.name;
  outcome.id = stored.id;
  outcome.duplicate = true;
  outcome.verdict = stored.verdict;
  outcome.reason = stored.reason;
  outcome.detail = "the same bytes are stored as " + stored.name;
  return outcome;
}

AddOutcome DoubleOf(const StoredDouble& stored, const PreparedPhoto& photo) {
  AddOutcome outcome = DuplicateOf(stored.image, photo);
  char size[32];
  std::snprintf(size, sizeof(size), "%.3g", stored.scale);
  outcome.detail = "the same picture as " + stored.image.name + " (#" +
                   std::to_string(stored.image.id.value) + "), at " + size + " times its width";
  return outcome;
}

AddOutcome NameTakenBy(const PreparedPhoto& photo) {
  AddOutcome outcome;
  outcome.name = photo.name;
  outcome.reason = Reason::kNameTaken;
  outcome.detail =
      "another photo of this contributor is stored under this name; rename the file to add it";
  return outcome;
}

AddOutcome Outdated(const PreparedPhoto& photo) {
  AddOutcome outcome;
  outcome.name = photo.name;
  outcome.failure = Status::Busy("a copy of the photo was removed while it waited: send it again");
  return outcome;
}

// What the caller learns of a photo that was located.
AddOutcome OutcomeOf(const ImageRecord& record, const LocatedPhoto& located) {
  const Placement& placement = located.placement;
  AddOutcome outcome;
  outcome.name = record.name;
  outcome.id = record.id;
  outcome.verdict = placement.verdict;
  outcome.reason = placement.reason;
  outcome.detail = placement.detail;
  outcome.reconstruction = placement.reconstruction;
  outcome.inlier_count = placement.inlier_count;
  outcome.pairs_tried = located.search.tried_count;
  outcome.neighbor_count = static_cast<uint32_t>(located.search.pairs.size());
  if (!placement.placed.empty())
    outcome.propagated.assign(placement.placed.begin() + 1, placement.placed.end());
  for (const auto& [image, what] : located.search.damaged) outcome.damaged.push_back({image, what});
  outcome.times = located.times;
  return outcome;
}

// The image with its pairs and words, its placement, and the photos that wait and may have waited
// for this photo's pairs alone.
Status WritePhoto(const IngestParts& parts, const ImageRecord& record, const LocatedPhoto& located,
                  std::span<const WordId> words, DatabaseState* state, const WriteScope& scope) {
  Transaction* const transaction = scope.transaction.get();
  ++state->retrievable_image_count;
  transaction->PutImage(record);
  std::vector<ImageId> others;
  for (const PairRecord& pair : located.search.pairs) {
    transaction->PutPair(pair);
    others.push_back(pair.a == record.id ? pair.b : pair.a);
  }
  if (state->vocabulary_generation != 0) {
    transaction->PutWords(state->vocabulary_generation, record.id, words);
    transaction->AddPostings(state->vocabulary_generation, words, record.id);
  }
  VEDUTA_RETURN_IF_ERROR(
      WritePlacement(*parts.map, *scope.base, located.placement, others, state, transaction));
  JournalAdded(record, located.placement.reconstruction, located.placement.detail, state,
               transaction);
  transaction->PutState(*state);
  return Status::Ok();
}

// Adjusts a submap, or carries out its motion where it has one; or else the reconstruction. A
// reconstruction that is too large to be adjusted whole is parted into submaps; once it is parted
// and even larger, it is relaxed.
Result<AdjustedWhole> Adjust(const IngestParts& parts, const DueStep& step, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(*scope.base));
  if (step.submap.valid()) {
    const SubmapRecord* const submap = submaps.Find(step.submap);
    if (submap == nullptr || !submap->motion)
      return AdjustSubmap(parts, step.reconstruction, step.submap, std::move(scope));
    VEDUTA_RETURN_IF_ERROR(MoveSubmaps(parts, step.reconstruction, step.submap, std::move(scope)));
    return AdjustedWhole();
  }
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          scope.base->GetReconstruction(step.reconstruction));
  const bool is_parted = submaps.IsParted(record.id);
  if (IsRelaxed(record, is_parted, parts.options.schedule))
    return RelaxReconstruction(parts, step.reconstruction, std::move(scope));
  if (record.image_count <= parts.options.schedule.whole_images_max || is_parted)
    return AdjustWhole(parts, step.reconstruction, std::move(scope));
  VEDUTA_RETURN_IF_ERROR(PartReconstruction(parts, step.reconstruction, std::move(scope)));
  return AdjustedWhole();
}

}  // namespace

Ingest::Ingest(Database* database, Retrieval* retrieval, ImageFeatureCache* features,
               ThreadPool* pool, IngestOptions options, Doubles doubles,
               const PhotoDecoder& decoder)
    : options_(std::move(options)),
      parts_{database, retrieval, features, pool, options_, &map_, &repetitions_},
      doubles_(doubles),
      decoder_(decoder) {}

Result<AddOutcome> Ingest::StoreRejection(const PreparedPhoto& photo, const CameraRecord& camera,
                                          ImageRecord record, WriteScope scope) {
  AddOutcome outcome;
  outcome.name = photo.name;
  outcome.reason = record.reason = photo.reason;
  outcome.detail = record.detail = photo.detail;
  outcome.verdict = record.verdict = Verdict::kRejected;
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  if (!record.id.valid()) record.id = ImageId(state.next_image++);
  VEDUTA_ASSIGN_OR_RETURN(outcome.camera, PutCameraIfNew(camera, scope, &state, &record));
  outcome.id = record.id;
  scope.transaction->PutImage(record);
  JournalAdded(record, {}, "rejected: " + record.detail, &state, scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  return outcome;
}

struct ComparedPhoto {
  const ImageFeatures& features;
  const std::shared_ptr<const Features>& extracted;
  std::span<const PairRecord> pairs;
  std::span<const WordId> words;
};

Result<AddOutcome> Ingest::AnswerDouble(const StoredDouble& stored, const PreparedPhoto& photo,
                                        const CameraRecord& camera, ImageRecord record,
                                        const ComparedPhoto& compared, WriteScope scope) {
  AddOutcome outcome = DoubleOf(stored, photo);
  if (doubles_ != Doubles::kBetter || !IsLarger(record, stored.image)) return outcome;
  VEDUTA_ASSIGN_OR_RETURN(const bool shows_private,
                          ShowsWhatIsFilled(*scope.base, record, stored.image));
  if (shows_private) {
    outcome.detail += ", which stays, for private areas are filled in it and not in this one";
    return outcome;
  }
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord stored_camera,
                          scope.base->GetCamera(stored.image.camera));
  if (camera.is_refinable && !stored_camera.is_refinable) {
    outcome.detail += ", which stays, for its camera is known and this one's is estimated: name it";
    return outcome;
  }
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(outcome.camera, PutCameraIfNew(camera, scope, &state, &record));
  const BetterVersion better{
      record,         camera.model,   compared.features,   compared.extracted,
      compared.pairs, compared.words, photo.original.get()};
  VEDUTA_ASSIGN_OR_RETURN(outcome.replaced,
                          TakeBetterVersion(parts_, stored.image, better, record.contributor,
                                            std::move(state), std::move(scope)));
  if (!outcome.replaced) outcome.camera.clear();
  outcome.detail +=
      outcome.replaced ? ", and takes its place" : ", and too few of its points are found in it";
  return outcome;
}

Result<AddOutcome> Ingest::Place(PreparedPhoto photo, const CameraRecord& camera,
                                 ImageRecord record, bool is_name_taken, WriteScope scope) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  if (!record.id.valid()) record.id = ImageId(state.next_image++);
  parts_.TrimMap();
  const auto extracted = std::make_shared<const Features>(std::move(photo.features));
  VEDUTA_ASSIGN_OR_RETURN(
      const auto image,
      ImageFeatures::Make(record.id, camera.model, Carried(camera, extracted),
                          options_.matched_count_max, ImageFeatures::Packing::kKept));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words,
                          parts_.retrieval->Words(*scope.base, *extracted));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<RankedImage> candidates,
                          parts_.retrieval->Candidates(*scope.base, *extracted));
  if (photo.awaited) {
    VEDUTA_RETURN_IF_ERROR(
        AddPartners(*scope.base, *photo.awaited, record.contributor, &candidates));
  }
  const double retrieve_ms = watch.LapMs();
  MapLoader loader(scope.base, parts_.features, &map_, parts_.pool);
  const MappingContext context{&loader, &map_, parts_.pool, options_.mapper, parts_.repetitions};
  std::optional<StoredDouble> stored_double;
  const PoseGiver give_pose = [&](const ImageFeatures& wide,
                                  std::span<const PairMatches> pairs) -> Result<Placement> {
    if (photo.awaited) return Postponed(Reason::kUndetermined, kAwaitsPoseDetail);
    if (doubles_ != Doubles::kKeep && !stored_double) {
      VEDUTA_ASSIGN_OR_RETURN(stored_double, FindDouble(*scope.base, decoder_, parts_.features,
                                                        {record, camera.model, wide}, pairs));
    }
    if (stored_double || is_name_taken) return Postponed(Reason::kNone, "");
    return PlacePhoto(context, wide, pairs, ReconstructionId(state.next_reconstruction),
                      photo.hash.Seed());
  };
  VEDUTA_ASSIGN_OR_RETURN(const LocatedPhoto located,
                          LocatePhoto(context, options_, *image, camera.model, candidates,
                                      give_pose, photo.hash.Seed()));
  if (stored_double) {
    return AnswerDouble(*stored_double, photo, camera, std::move(record),
                        {*image, extracted, located.search.pairs, words}, std::move(scope));
  }
  if (is_name_taken) return NameTakenBy(photo);
  watch.LapMs();
  record.verdict = located.placement.verdict;
  record.reason = located.placement.reason;
  record.detail = located.placement.detail;
  VEDUTA_ASSIGN_OR_RETURN(const std::string new_camera,
                          PutCameraIfNew(camera, scope, &state, &record));
  VEDUTA_RETURN_IF_ERROR(WritePhoto(parts_, record, located, words, &state, scope));
  scope.transaction->KeepFeatures(record.photo, extracted);
  if (photo.original) scope.transaction->SealOriginal(record.id, *photo.original);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  map_.ClearChanges();
  parts_.features->Put(record.photo, image);
  AddOutcome outcome = OutcomeOf(record, located);
  outcome.camera = new_camera;
  outcome.times.retrieve_ms = retrieve_ms;
  outcome.times.commit_ms = watch.LapMs();
  return outcome;
}

Result<AddOutcome> Ingest::AdmitAndPlace(PreparedPhoto photo, CameraRecord camera,
                                         const std::string& contributor) {
  Stopwatch total;
  WriteScope scope = BeginWrite(parts_.database);
  // It may have been refined since the photo was prepared; its features are the same.
  if (camera.id.valid()) {
    VEDUTA_ASSIGN_OR_RETURN(camera, scope.base->GetCamera(camera.id));
  }
  VEDUTA_ASSIGN_OR_RETURN(Admission admission, Admit(*scope.base, photo, camera.id, contributor));
  bool is_name_taken = false;
  switch (admission.outcome) {
    case AdmissionOutcome::kDuplicate:
      return DuplicateOf(admission.stored, photo);
    case AdmissionOutcome::kNameTaken:
      if (doubles_ != Doubles::kBetter || !admission.is_prepared) return NameTakenBy(photo);
      is_name_taken = true;
      break;
    case AdmissionOutcome::kRejected:
      return StoreRejection(photo, camera, std::move(admission.record), std::move(scope));
    case AdmissionOutcome::kOutdated:
      return Outdated(photo);
    case AdmissionOutcome::kNew:
      break;
  }
  const double decode_ms = photo.decode_ms, undistort_ms = photo.undistort_ms,
               features_ms = photo.features_ms;
  VEDUTA_ASSIGN_OR_RETURN(AddOutcome outcome,
                          Place(std::move(photo), camera, std::move(admission.record),
                                is_name_taken, std::move(scope)));
  outcome.times.decode_ms = decode_ms;
  outcome.times.undistort_ms = undistort_ms;
  outcome.times.features_ms = features_ms;
  outcome.times.total_ms = total.LapMs() + decode_ms + undistort_ms + features_ms;
  return outcome;
}

Result<AddOutcome> Ingest::Apply(PreparedPhoto photo, const CameraRecord& camera,
                                 const std::string& contributor) {
  Result<AddOutcome> outcome = CatchShortage(
      "place the photo", [&] { return AdmitAndPlace(std::move(photo), camera, contributor); });
  if (!outcome.ok()) map_.Clear();
  return outcome;
}

Result<RemovedPhoto> Ingest::Remove(ImageId image, const std::string& actor,
                                    const std::string& why) {
  Result<RemovedPhoto> removed = CatchShortage("remove the photo", [&] {
    return RemovePhoto(parts_, image, actor, why, BeginWrite(parts_.database));
  });
  if (!removed.ok()) map_.Clear();
  return removed;
}

Status Ingest::ForbidPose(ImageId image, const std::string& actor, const std::string& reason) {
  const Status forbidden = CatchShortage("forbid the pose", [&] {
    return veduta::ForbidPose(parts_, image, actor, reason, BeginWrite(parts_.database));
  });
  if (!forbidden.ok()) map_.Clear();
  return forbidden;
}

Result<ModelFounding> Ingest::Found(std::span<const ModelPose> poses, const std::string& actor) {
  Result<ModelFounding> founded = CatchShortage("place the photos of the model", [&] {
    return FoundByModel(parts_, poses, actor, BeginWrite(parts_.database));
  });
  if (!founded.ok()) map_.Clear();
  return founded;
}

Result<std::optional<DueStep>> Ingest::FindStep(const Snapshot& snapshot,
                                                const std::optional<DueStep>& at_work) const {
  if (is_state_unreadable_) return std::optional<DueStep>();
  return CatchShortage("find the next step", [&] {
    return FindDueStep(snapshot, options_.schedule, *parts_.retrieval, set_aside_, at_work);
  });
}

std::optional<DueStep> Ingest::FindLong(const Snapshot& snapshot) const {
  const Result<std::optional<DueStep>> step = CatchShortage("find the next long step", [&] {
    return FindLongStep(snapshot, options_.schedule, *parts_.retrieval, set_aside_);
  });
  return step.ok() ? *step : std::nullopt;  // what cannot be read fails the next step, too
}

FollowUp Ingest::Commit(LargeAdjustment* adjustment, ReconstructionId reconstruction) {
  FollowUp done;
  done.kind = FollowUpKind::kAdjustment;
  done.reconstruction = reconstruction;
  done.status = CatchShortage("adjust the photos again", [&]() -> Status {
    VEDUTA_ASSIGN_OR_RETURN(AdjustedWhole adjusted, adjustment->Commit(&map_));
    done.unplaced = std::move(adjusted.unplaced);
    done.split_off = std::move(adjusted.split_off);
    return Status::Ok();
  });
  if (!done.status.ok()) map_.Clear();
  return done;
}

FollowUp Ingest::Run(const DueStep& step, WriteScope scope) {
  FollowUp done;
  done.kind = step.kind;
  done.image = step.image;
  done.reconstruction = step.reconstruction;
  done.other = step.other;
  done.status = CatchShortage("place or adjust the photos again", [&]() -> Status {
    if (step.kind == FollowUpKind::kAdjustment) {
      VEDUTA_ASSIGN_OR_RETURN(AdjustedWhole adjusted, Adjust(parts_, step, std::move(scope)));
      done.unplaced = std::move(adjusted.unplaced);
      done.split_off = std::move(adjusted.split_off);
      return Status::Ok();
    }
    if (step.kind == FollowUpKind::kJudgment) {
      VEDUTA_ASSIGN_OR_RETURN(Judgment judgment,
                              JudgeAnew(parts_, step.reconstruction, step.other, std::move(scope)));
      done.merged_into = judgment.merged_into;
      done.unplaced = std::move(judgment.taken_out.unplaced);
      done.split_off = std::move(judgment.taken_out.split_off);
      return Status::Ok();
    }
    if (step.kind == FollowUpKind::kGeoreference)
      return LookForPlace(step.reconstruction, std::move(scope));
    if (step.kind == FollowUpKind::kVocabulary) return Status::Ok();  // RunNextStep leaves it
    VEDUTA_ASSIGN_OR_RETURN(done.placed, RetryPhoto(parts_, step.image, std::move(scope)));
    return Status::Ok();
  });
  return done;
}

void Ingest::TryFailedAgain() {
  set_aside_ = StepsSetAside();
  is_state_unreadable_ = false;
}

std::optional<FollowUp> Ingest::RunNextStep(LongSteps* long_steps) {
  WriteScope scope = BeginWrite(parts_.database);
  const Result<std::optional<DueStep>> step =
      FindStep(*scope.base, long_steps != nullptr ? long_steps->at_work : std::nullopt);
  if (!step.ok()) {
    is_state_unreadable_ = true;
    FollowUp unread;
    unread.status = step.status();
    return unread;
  }
  if (!*step) return std::nullopt;
  if (long_steps != nullptr && (*step)->is_long) long_steps->next = *step;
  if ((*step)->is_long && (long_steps != nullptr || (*step)->kind == FollowUpKind::kVocabulary))
    return std::nullopt;
  FollowUp done = Run(**step, std::move(scope));
  if (!done.status.ok()) {
    map_.Clear();
    set_aside_.Add(**step);
  }
  if (long_steps != nullptr && long_steps->at_once && !long_steps->at_work)
    long_steps->next = FindLong(*parts_.database->GetSnapshot());
  return done;
}

}  // namespace veduta
