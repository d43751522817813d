// SPDX-License-Identifier: Apache-2.0
// The members of Scheduler that work on one photo: they have it blurred and prepared, and apply it
// in its turn.
#include <utility>

#include "engine/schedule/scheduler.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

AddOutcome NotJudged(const WaitingPhoto& photo, Status failure) {
  AddOutcome outcome;
  outcome.name = photo.photo.name;
  outcome.failure = std::move(failure);
  return outcome;
}

// Why the photo was not prepared; OK where it was.
Status FailureOf(const Result<PreparedPhoto>& prepared) {
  return prepared.ok() ? prepared->failure : prepared.status();
}

// A failure that need not befall the next photo. After a failed write all others fail, too.
bool IsOfOnePhoto(const Status& status) {
  return status.code() != StatusCode::kIoError && status.code() != StatusCode::kBusy;
}

bool IsStorable(const Result<PreparedPhoto>& prepared) {
  return prepared.ok() && prepared->failure.ok() && !prepared->known &&
         prepared->reason == Reason::kNone;
}

// Puts what is to be stored in the place of the photo. What fails is tried again when the photo is
// put in line the next time.
Status Blur(const PhotoBlurrer& blurrer, WaitingPhoto* photo) {
  VEDUTA_ASSIGN_OR_RETURN(BlurredPhoto blurred, blurrer.Blur(photo->photo));
  photo->is_blurred = blurred.was_asked;
  if (!blurred.filled) return Status::Ok();
  photo->photo.bytes = std::move(blurred.filled);
  photo->original = std::make_shared<const std::vector<uint8_t>>(std::move(blurred.original));
  return Status::Ok();
}

}  // namespace

Result<AddOutcome> Scheduler::ApplyPrepared(Entry* entry) {
  (*entry->prepared)->contribution = entry->photo.contribution;
  (*entry->prepared)->awaited = entry->photo.awaited;
  (*entry->prepared)->original = entry->photo.original;
  Writer::Turn turn = writer_->Take();
  return (*ingest_)->Apply(std::move(**entry->prepared), *entry->photo.camera,
                           entry->photo.contributor);
}

Result<PreparedPhoto> Scheduler::Prepare(WaitingPhoto* photo,
                                         PhotoPreparer::Company company) const {
  PreparedPhoto failed;
  failed.name = photo->photo.name;
  if (blurrer_ != nullptr && !photo->is_blurred) {
    photo->blur_failure = Blur(*blurrer_, photo);
    failed.failure = photo->blur_failure;
    if (!failed.failure.ok()) return failed;
  }
  failed.failure = Status::NotFound("the photo's camera is not known yet");
  if (!photo->camera) {
    Result<std::optional<CameraRecord>> found = cameras_.find(photo->photo);
    if (found.ok()) photo->camera = std::move(*found);
    if (!found.ok()) failed.failure = found.status();
  }
  if (!photo->camera) return failed;
  Result<PreparedPhoto> prepared = preparer_->Prepare(
      photo->photo, photo->camera->extraction_model(), photo->contributor, company);
  if (blurrer_ == nullptr || photo->is_blurred || !IsStorable(prepared)) return prepared;
  // It could not be decoded before, or was stored until now.
  failed.failure = Status::Busy("it waits to be blurred: nobody has told what is private in it");
  return failed;
}

Result<std::optional<AddOutcome>> Scheduler::SeekCamera(Entry* entry, StepTimes* times) {
  Result<std::optional<CameraRecord>> found = cameras_.find(entry->photo.photo);
  if (!found.ok()) return std::optional(NotJudged(entry->photo, found.status()));
  entry->photo.camera = std::move(*found);
  if (entry->photo.camera) return std::optional<AddOutcome>();
  Result<EstimatedUnnamed> estimated = cameras_.estimate(entry->photo.photo);
  if (!estimated.ok()) {
    if (!IsOfOnePhoto(estimated.status())) return estimated.status();
    return std::optional(NotJudged(entry->photo, estimated.status()));
  }
  if (!estimated->camera) return std::optional(std::move(estimated->outcome));
  entry->photo.camera = std::move(estimated->camera);
  *times = estimated->outcome.times;
  return std::optional<AddOutcome>();
}

Result<AddOutcome> Scheduler::ApplyInTurn(Entry* entry) {
  StepTimes seeking;
  // Once more where memory was short, or the database was being opened again.
  const Status& blur_failure = entry->photo.blur_failure;
  if (!blur_failure.ok() && blur_failure.code() != StatusCode::kBusy)
    entry->prepared = Prepare(&entry->photo, PhotoPreparer::Company::kOthers);
  if (!blur_failure.ok()) return NotJudged(entry->photo, blur_failure);
  if (!entry->photo.camera) {
    VEDUTA_ASSIGN_OR_RETURN(std::optional<AddOutcome> refused, SeekCamera(entry, &seeking));
    if (refused) return std::move(*refused);
  }
  Result<AddOutcome> outcome = PrepareAndApply(entry);
  if (outcome.ok() && entry->had_no_camera && !outcome->duplicate) {
    if (outcome->camera.empty()) outcome->camera = entry->photo.camera->name;
    outcome->times.map_ms += seeking.map_ms;
    outcome->times.total_ms += seeking.total_ms;
  }
  return outcome;
}

Result<AddOutcome> Scheduler::PrepareAndApply(Entry* entry) {
  // The preparation is tried once more: it may have failed because the database was being opened
  // again, or because others took the memory. Only where memory was short is the photo prepared
  // alone: a folder of missing files must not hold up the others.
  if (const Status failure = FailureOf(*entry->prepared); !failure.ok()) {
    const auto company = failure.code() == StatusCode::kNoMemory ? PhotoPreparer::Company::kAlone
                                                                 : PhotoPreparer::Company::kOthers;
    entry->prepared = Prepare(&entry->photo, company);
  }
  if (!entry->prepared->ok()) return entry->prepared->status();
  if (!(*entry->prepared)->failure.ok())
    return NotJudged(entry->photo, (*entry->prepared)->failure);
  Result<AddOutcome> outcome = ApplyPrepared(entry);
  // Once more where a copy of the photo was removed since it was prepared.
  if (outcome.ok() && outcome->failure.code() == StatusCode::kBusy) {
    entry->prepared = Prepare(&entry->photo, PhotoPreparer::Company::kOthers);
    if (!entry->prepared->ok()) return entry->prepared->status();
    if (!(*entry->prepared)->failure.ok())
      return NotJudged(entry->photo, (*entry->prepared)->failure);
    outcome = ApplyPrepared(entry);
  }
  if (!outcome.ok() && IsOfOnePhoto(outcome.status()))
    return NotJudged(entry->photo, outcome.status());
  return outcome;
}

}  // namespace veduta
