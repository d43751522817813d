// SPDX-License-Identifier: Apache-2.0
// The members of Engine and of Questions about photos that wait on the disk for their turn.
#include <algorithm>
#include <ctime>
#include <utility>

#include "engine/engine.h"
#include "engine/first_cameras.h"
#include "engine/parts.h"
#include "engine/photo/photo_file.h"

namespace veduta {
namespace {

// Photos that wait on the disk since their camera cannot be told; one more is refused. Chosen by
// hand: as many as a few people take in a day.
constexpr size_t kAwaitingCameraMax = 2000;

// The photo's bytes, which are read into `own` where the source does not have them.
Result<std::span<const uint8_t>> BytesOf(const PhotoSource& source, uint64_t size_bytes_max,
                                         std::vector<uint8_t>* own) {
  if (source.bytes) return std::span<const uint8_t>(*source.bytes);
  VEDUTA_ASSIGN_OR_RETURN(*own,
                          source.read ? source.read() : ReadPhotoFile(source.path, size_bytes_max));
  if (own->size() <= size_bytes_max) return std::span<const uint8_t>(*own);
  return Status::InvalidArgument(source.path + " has more than " + std::to_string(size_bytes_max) +
                                 " bytes, which no photo may have");
}

// The image of a photo that was applied, and whose upload a kill or a power cut has left.
Result<std::optional<ImageRecord>> FindImageOf(const Snapshot& snapshot,
                                               const UploadRecord& upload) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                          snapshot.FindImageByPhoto(upload.photo));
  if (!stored) return std::optional<ImageRecord>();
  VEDUTA_ASSIGN_OR_RETURN(ImageRecord image, snapshot.GetImage(*stored));
  if (image.name != upload.name || image.contributor != upload.contributor)
    return std::optional<ImageRecord>();
  return std::optional<ImageRecord>(std::move(image));
}

// What became of such a photo, as far as the database tells.
Result<AddOutcome> OutcomeOf(const Snapshot& snapshot, const ImageRecord& image,
                             const UploadRecord& upload) {
  AddOutcome outcome;
  outcome.name = image.name;
  outcome.id = image.id;
  outcome.verdict = image.verdict;
  outcome.reason = image.reason;
  outcome.detail = image.detail;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image.id));
  if (pose) outcome.reconstruction = pose->reconstruction;
  if (upload.camera.empty() && image.camera.valid()) {
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
    outcome.camera = camera.name;
  }
  return outcome;
}

// What its contribution is to say of the photo; nothing where it is a part of none.
std::optional<ContributedPhoto> FateOf(const UploadRecord& upload, ContributionFate fate,
                                       ImageId image = {}) {
  if (upload.contribution == 0) return std::nullopt;
  ContributedPhoto photo;
  photo.contribution = upload.contribution;
  photo.upload = upload.number;
  photo.fate = fate;
  photo.image = image;
  // What an image has goes with it, and leaves no name here.
  if (!image.valid() && fate != ContributionFate::kRemoved) photo.name = upload.name;
  return photo;
}

std::optional<ContributedPhoto> FateOf(const UploadRecord& upload,
                                       const Result<AddOutcome>& answer) {
  if (!answer.ok())
    return FateOf(upload, answer.status().code() == StatusCode::kCancelled
                              ? ContributionFate::kRemoved
                              : ContributionFate::kFailed);
  if (!answer->failure.ok()) return FateOf(upload, ContributionFate::kFailed);
  if (answer->id.valid()) {
    return FateOf(upload,
                  answer->duplicate ? ContributionFate::kDuplicate : ContributionFate::kStored,
                  answer->id);
  }
  std::optional<ContributedPhoto> photo = FateOf(upload, ContributionFate::kNotStored);
  if (!photo) return photo;
  photo->verdict = answer->verdict;
  photo->reason = answer->reason;
  return photo;
}

}  // namespace

Result<Ticket> Engine::Submit(PhotoSubmission photo, AnswerCallback answered) {
  EngineParts& parts = *parts_;
  VEDUTA_ASSIGN_OR_RETURN(std::optional<CameraRecord> camera, parts.FindNamed(photo.camera));
  std::vector<uint8_t> own;
  VEDUTA_ASSIGN_OR_RETURN(const std::span<const uint8_t> bytes,
                          BytesOf(photo.photo, parts.tuning.prepare.limits.size_bytes_max, &own));
  UploadRecord upload;
  upload.name = std::move(photo.photo.name);
  upload.contributor = std::move(photo.contributor);
  upload.camera = std::move(photo.camera);
  upload.photo = HashContent(bytes);
  upload.size_bytes = bytes.size();
  upload.time_unix_s = std::time(nullptr);
  upload.contribution = photo.contribution;
  const std::lock_guard lock(parts.lining_mutex);
  VEDUTA_RETURN_IF_ERROR(parts.CheckContribution(upload.contribution, upload.contributor));
  VEDUTA_ASSIGN_OR_RETURN(upload.number, parts.database->AddUpload(upload, bytes));
  Result<Ticket> ticket = parts.Line(upload, std::move(camera), std::move(answered));
  if (!ticket.ok()) {
    const std::optional<ContributedPhoto> fate = FateOf(upload, ContributionFate::kFailed);
    parts.database->DeleteUpload(upload.number, fate ? &*fate : nullptr)
        .IgnoreBecause("the photo is refused for another reason, and would be applied later");
  }
  return ticket;
}

Result<Ticket> Engine::Resume(uint64_t upload, AnswerCallback answered) {
  EngineParts& parts = *parts_;
  std::unique_lock lock(parts.lining_mutex);
  if (parts.IsInLine(upload))
    return Status::AlreadyExists("upload " + std::to_string(upload) + " is in line already");
  const std::shared_ptr<const Snapshot> snapshot = parts.database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const UploadRecord record, snapshot->GetUpload(upload));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageRecord> image, FindImageOf(*snapshot, record));
  if (image) {
    VEDUTA_ASSIGN_OR_RETURN(AddOutcome outcome, OutcomeOf(*snapshot, *image, record));
    const std::optional<ContributedPhoto> fate =
        FateOf(record, ContributionFate::kStored, image->id);
    VEDUTA_RETURN_IF_ERROR(parts.database->DeleteUpload(upload, fate ? &*fate : nullptr));
    lock.unlock();
    Ticket ticket = SubmissionLine::Answered(upload, std::move(outcome));
    if (answered) answered(ticket.Wait());
    return ticket;
  }
  return parts.LineStored(record, std::move(answered));
}

Result<std::vector<FirstCamera>> Engine::CalibrateWaiting(std::stop_token stop) {
  EngineParts& parts = *parts_;
  std::set<uint64_t> awaiting;
  {
    const std::lock_guard lock(parts.uploads_mutex);
    awaiting = parts.awaiting_camera;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<UploadRecord> all,
                          parts.database->GetSnapshot()->ListUploads());
  std::vector<uint64_t> numbers;
  std::vector<PhotoSubmission> photos;
  std::set<ContentHash> hashes;  // one photo that was sent twice shows nothing new
  for (const UploadRecord& upload : all) {
    if (!awaiting.contains(upload.number) || !hashes.insert(upload.photo).second) continue;
    numbers.push_back(upload.number);
    photos.push_back({parts.SourceOf(upload), "", upload.contributor});
  }
  VEDUTA_ASSIGN_OR_RETURN(std::vector<FirstCamera> cameras,
                          veduta::CalibrateFirst(&parts, photos, std::move(stop)));
  for (size_t i = 0; i < photos.size(); ++i) {
    if (photos[i].camera.empty()) continue;
    const std::lock_guard lock(parts.lining_mutex);
    if (parts.IsInLine(numbers[i])) continue;  // somebody has resumed it meanwhile
    const Status named = parts.database->NameUploadCamera(numbers[i], photos[i].camera);
    if (named.code() != StatusCode::kNotFound) VEDUTA_RETURN_IF_ERROR(named);  // it was removed
  }
  VEDUTA_RETURN_IF_ERROR(EndAwaiting(&parts, hashes));
  return cameras;
}

Result<std::vector<UploadAnswer>> Questions::Uploads() const {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<UploadRecord> records, view_->snapshot->ListUploads());
  std::vector<UploadAnswer> uploads;
  uploads.reserve(records.size());
  for (const UploadRecord& record : records) {
    if (record.contribution != 0) {
      VEDUTA_ASSIGN_OR_RETURN(const bool sees,
                              view_->visibility().SeesContribution(record.contribution));
      if (!sees) continue;
    }
    uploads.push_back({record.number, record.name, record.contributor, record.camera,
                       record.photo.Hex(), record.size_bytes, record.time_unix_s,
                       record.contribution});
  }
  return uploads;
}

bool EngineParts::IsInLine(uint64_t upload) {
  const std::lock_guard lock(uploads_mutex);
  return uploads.contains(upload);
}

Result<Ticket> EngineParts::LineStored(const UploadRecord& upload, AnswerCallback answered) {
  Result<std::optional<CameraRecord>> camera = FindNamed(upload.camera);
  // A repair may have lost the camera: then it is found as that of a photo that names none.
  if (camera.status().code() == StatusCode::kNotFound) camera = std::optional<CameraRecord>();
  VEDUTA_RETURN_IF_ERROR(camera.status());
  return Line(upload, *std::move(camera), std::move(answered));
}

PhotoSource EngineParts::SourceOf(const UploadRecord& upload) {
  PhotoSource photo;
  photo.name = upload.name;
  photo.read = [this, number = upload.number]() -> Result<std::vector<uint8_t>> {
    VEDUTA_ASSIGN_OR_RETURN(const StoredBytes stored,
                            database->GetSnapshot()->GetUploadBytes(number));
    return std::vector<uint8_t>(stored.bytes().begin(), stored.bytes().end());
  };
  return photo;
}

void EngineParts::LeaveLine(const UploadRecord& upload, bool has_ended,
                            const Result<AddOutcome>& answer) {
  if (!has_ended && answer.status().code() == kCameraUnknown) {
    const std::lock_guard lock(uploads_mutex);
    has_ended = awaiting_camera.size() >= kAwaitingCameraMax;
    if (!has_ended) awaiting_camera.insert(upload.number);
  }
  if (has_ended) {
    const std::optional<ContributedPhoto> fate = FateOf(upload, answer);
    database->DeleteUpload(upload.number, fate ? &*fate : nullptr)
        .IgnoreBecause(
            "it is there once more when the database is next opened, and Resume finds it stored");
  }
  const std::lock_guard lock(uploads_mutex);
  uploads.erase(upload.number);
}

Result<Ticket> EngineParts::Line(const UploadRecord& upload, std::optional<CameraRecord> camera,
                                 AnswerCallback answered) {
  WaitingPhoto photo;
  photo.photo = SourceOf(upload);
  photo.camera = std::move(camera);
  photo.contributor = upload.contributor;
  photo.contribution = upload.contribution;
  photo.answered = std::move(answered);
  photo.leave = [this, upload](bool has_ended, const Result<AddOutcome>& answer) {
    LeaveLine(upload, has_ended, answer);
  };
  const std::lock_guard lock(uploads_mutex);
  VEDUTA_ASSIGN_OR_RETURN(Ticket ticket, scheduler->Submit(upload.number, std::move(photo)));
  uploads.emplace(upload.number, ticket);
  awaiting_camera.erase(upload.number);
  return ticket;
}

Result<uint64_t> EngineParts::RemoveUploads(const RemoveRequest& request) {
  const auto is_wanted = [&](const auto& upload) {
    return request.contribution != 0 ? upload.contribution == request.contribution
                                     : upload.contributor == request.contributor;
  };
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(std::vector<UploadRecord> all, snapshot->ListUploads());
  std::erase_if(all, [&](const UploadRecord& upload) { return !is_wanted(upload); });
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PartialUploadRecord> partial,
                          snapshot->contributing().ListPartialUploads());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PartialUploadRecord> arrived,
                          snapshot->contributing().ListPartialUploads(true));
  if (all.empty() && std::ranges::none_of(partial, is_wanted) &&
      std::ranges::none_of(arrived, is_wanted))
    return uint64_t{0};
  {  // Whoever is killed from here on leaves bytes, of which PurgeRemoved rids the files.
    Writer::Turn turn = writer->Take();
    const std::unique_ptr<Transaction> transaction = turn.database().BeginTransaction();
    VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, transaction->base()->GetState());
    state.removed_bytes_left = true;
    transaction->PutState(state);
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  }
  VEDUTA_ASSIGN_OR_RETURN(uint64_t removed, DeletePartialUploads(is_wanted));
  for (const UploadRecord& upload : all) {
    std::optional<Ticket> ticket;
    {
      const std::lock_guard lock(uploads_mutex);
      if (const auto found = uploads.find(upload.number); found != uploads.end())
        ticket = found->second;
    }
    // One whose turn has come has had it then, unless it waits on.
    const bool is_cancelled = ticket && ticket->Cancel();
    if (ticket && !is_cancelled)
      ticket->Wait().status().IgnoreBecause("whether it waits on is asked below");
    const std::lock_guard lock(lining_mutex);
    const Result<UploadRecord> waits = database->GetSnapshot()->GetUpload(upload.number);
    if (!is_cancelled && waits.status().code() == StatusCode::kNotFound) continue;
    const std::optional<ContributedPhoto> fate = FateOf(upload, ContributionFate::kRemoved);
    VEDUTA_RETURN_IF_ERROR(database->DeleteUpload(upload.number, fate ? &*fate : nullptr));
    {
      const std::lock_guard line_lock(uploads_mutex);
      awaiting_camera.erase(upload.number);
    }
    ++removed;
  }
  return removed;
}

}  // namespace veduta
