// SPDX-License-Identifier: Apache-2.0
// The members of Engine and of Questions about contributions.
#include <algorithm>
#include <ctime>
#include <utility>

#include "engine/engine.h"
#include "engine/ingest/write_scope.h"
#include "engine/journal/journal.h"
#include "engine/parts.h"
#include "storage/base/plain_text.h"

namespace veduta {
namespace {

constexpr size_t kCommentBytesMax = 2000, kLicenceBytesMax = 200;
// As many as a changeset of OpenStreetMap has changes.
constexpr uint64_t kPhotosMax = 10'000;

constexpr const char* kAction = "contribution";

Status CheckText(const char* what, const std::string& text, size_t bytes_max, bool has_lines) {
  if (text.size() > bytes_max)
    return Status::InvalidArgument(std::string(what) + " has " + std::to_string(text.size()) +
                                   " bytes, but must have at most " + std::to_string(bytes_max));
  if (!IsPlainText(text, has_lines))
    return Status::InvalidArgument(std::string(what) + " is no UTF-8, or has control characters");
  return Status::Ok();
}

Result<ContributionAnswer> ToAnswer(const Snapshot& snapshot, const ContributionRecord& record) {
  ContributionAnswer answer{record.number,     record.contributor,   record.comment,
                            record.licence,    record.opened_unix_s, record.closed_unix_s,
                            record.photo_count};
  VEDUTA_ASSIGN_OR_RETURN(answer.is_hidden,
                          snapshot.moderation().IsHidden(HiddenKind::kContribution, record.number));
  return answer;
}

Status NoSuch(uint32_t number) {
  return Status::NotFound("there is no contribution " + std::to_string(number));
}

Result<ContributionRecord> Find(const Snapshot& snapshot, uint32_t number) {
  VEDUTA_ASSIGN_OR_RETURN(std::optional<ContributionRecord> found,
                          snapshot.contributing().FindContribution(number));
  if (!found) return NoSuch(number);
  return *std::move(found);
}

// One that is out of sight is none.
Result<ContributionRecord> FindSeen(const Snapshot& snapshot, const Visibility& visibility,
                                    uint32_t number) {
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.SeesContribution(number));
  if (!sees) return NoSuch(number);
  return Find(snapshot, number);
}

// What is known of a photo, by the verdict that its image has now.
Result<ContributedPhotoAnswer> AnswerOf(const Snapshot& snapshot, const Visibility& visibility,
                                        const ContributedPhoto& photo) {
  ContributedPhotoAnswer answer{photo.upload, photo.name, "removed", {}, photo.reason};
  switch (photo.fate) {
    case ContributionFate::kWaiting:
      answer.state = "waiting";
      return answer;
    case ContributionFate::kNotStored:
      answer.state = VerdictWord(photo.verdict);
      return answer;
    case ContributionFate::kFailed:
      answer.state = "failed";
      return answer;
    case ContributionFate::kRemoved:
      return answer;
    case ContributionFate::kStored:
    case ContributionFate::kDuplicate:
      break;
  }
  const Result<ImageRecord> image = snapshot.GetImage(photo.image);
  if (image.status().code() == StatusCode::kNotFound) return answer;
  VEDUTA_RETURN_IF_ERROR(image.status());
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(*image));
  if (sees) {
    answer.name = image->name;
    answer.image = image->id;
  }
  const bool is_stored = photo.fate == ContributionFate::kStored;
  answer.state = is_stored ? VerdictWord(image->verdict) : "duplicate";
  if (is_stored) answer.reason = image->reason;
  if (is_stored && !sees) answer.state = "hidden";
  return answer;
}

void Count(const ContributedPhotoAnswer& photo, bool is_stored, ContributionSums* sums) {
  const std::string& state = photo.state;
  const bool is_placed = state == "placed" || state == "merged" || state == "founded";
  // One that fits nowhere yet and is not stored has to be sent again.
  const bool is_refused = state == "rejected" || (state == "postponed" && !is_stored);
  const bool is_postponed = state == "postponed" && is_stored;
  ++(state == "waiting"     ? sums->waiting
     : is_placed            ? sums->placed
     : is_postponed         ? sums->postponed
     : is_refused           ? sums->refused
     : state == "duplicate" ? sums->duplicates
     : state == "failed"    ? sums->failed
                            : sums->removed);
  if (is_postponed || is_refused) ++sums->reasons[photo.reason];
}

// Calls visit on the answer of each photo from `first` on, until it returns false.
Status VisitPhotos(
    const Snapshot& snapshot, const Visibility& visibility, uint32_t number, uint64_t first,
    const std::function<bool(const ContributedPhoto&, ContributedPhotoAnswer)>& visit) {
  Status failure;
  VEDUTA_RETURN_IF_ERROR(snapshot.contributing().ScanContributedPhotos(
      number, first, [&](const ContributedPhoto& photo) {
        Result<ContributedPhotoAnswer> answer = AnswerOf(snapshot, visibility, photo);
        failure = answer.status();
        return answer.ok() && visit(photo, *std::move(answer));
      }));
  return failure;
}

}  // namespace

Status ContributionRequest::Check() const {
  if (contributor.empty()) return Status::InvalidArgument("a contribution needs a contributor");
  VEDUTA_RETURN_IF_ERROR(CheckText("the comment", comment, kCommentBytesMax, true));
  return CheckText("the licence", licence, kLicenceBytesMax, false);
}

Result<ContributionAnswer> Questions::Contribution(uint32_t number) const {
  VEDUTA_ASSIGN_OR_RETURN(const ContributionRecord found,
                          FindSeen(*view_->snapshot, view_->visibility(), number));
  return ToAnswer(*view_->snapshot, found);
}

Result<std::vector<ContributionAnswer>> Questions::Contributions(uint32_t first,
                                                                 uint32_t count_max) const {
  std::vector<ContributionAnswer> answers;
  if (count_max == 0) return answers;
  veduta::Status failure;
  VEDUTA_RETURN_IF_ERROR(view_->snapshot->contributing().ScanContributions(
      first, [&](const ContributionRecord& contribution) {
        const Result<bool> sees = view_->visibility().SeesContribution(contribution.number);
        failure = sees.status();
        if (!sees.ok() || !*sees) return sees.ok();
        Result<ContributionAnswer> answer = ToAnswer(*view_->snapshot, contribution);
        failure = answer.status();
        if (answer.ok()) answers.push_back(*std::move(answer));
        return failure.ok() && answers.size() < count_max;
      }));
  VEDUTA_RETURN_IF_ERROR(failure);
  return answers;
}

Result<ContributionSums> Questions::ContributionVerdicts(uint32_t number) const {
  const Snapshot& snapshot = *view_->snapshot;
  VEDUTA_RETURN_IF_ERROR(FindSeen(snapshot, view_->visibility(), number).status());
  ContributionSums sums;
  // Counts tell of no photo which one it is.
  VEDUTA_RETURN_IF_ERROR(
      VisitPhotos(snapshot, {snapshot, Sight()}, number, 0,
                  [&](const ContributedPhoto& photo, const ContributedPhotoAnswer& told) {
                    Count(told, photo.fate == ContributionFate::kStored, &sums);
                    return true;
                  }));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PartialUploadRecord> partial,
                          snapshot.contributing().ListPartialUploads());
  sums.arriving = static_cast<uint64_t>(
      std::ranges::count(partial, number, &PartialUploadRecord::contribution));
  return sums;
}

Result<std::vector<ContributedPhotoAnswer>> Questions::ContributedPhotos(uint32_t number,
                                                                         uint64_t first,
                                                                         uint32_t count_max) const {
  const Visibility visibility = view_->visibility();
  VEDUTA_RETURN_IF_ERROR(FindSeen(*view_->snapshot, visibility, number).status());
  std::vector<ContributedPhotoAnswer> answers;
  if (count_max == 0) return answers;
  VEDUTA_RETURN_IF_ERROR(VisitPhotos(*view_->snapshot, visibility, number, first,
                                     [&](const ContributedPhoto&, ContributedPhotoAnswer photo) {
                                       answers.push_back(std::move(photo));
                                       return answers.size() < count_max;
                                     }));
  return answers;
}

Result<uint32_t> Engine::OpenContribution(const ContributionRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  Writer::Turn turn = parts_->writer->Take();
  const std::lock_guard lock(parts_->lining_mutex);
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t last, scope.base->contributing().LastContribution());
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  ContributionRecord contribution;
  contribution.number = last + 1;
  contribution.contributor = request.contributor;
  contribution.comment = request.comment;
  contribution.licence = request.licence;
  contribution.opened_unix_s = std::time(nullptr);
  scope.transaction->PutContribution(contribution);
  AppendJournal({0, 0, request.actor, kAction, {}, {}, "opened " + std::to_string(last + 1)},
                &state, scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  return contribution.number;
}

Status Engine::CloseContribution(uint32_t number, const std::string& actor) {
  Writer::Turn turn = parts_->writer->Take();
  const std::lock_guard lock(parts_->lining_mutex);
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(ContributionRecord contribution, Find(*scope.base, number));
  if (contribution.closed_unix_s != 0) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  contribution.closed_unix_s = std::time(nullptr);
  scope.transaction->PutContribution(contribution);
  AppendJournal({0, 0, actor, kAction, {}, {}, "closed " + std::to_string(number)}, &state,
                scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Status EngineParts::CheckContribution(uint32_t contribution, const std::string& contributor) {
  if (contribution == 0) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const ContributionRecord found,
                          Find(*database->GetSnapshot(), contribution));
  const std::string what = "contribution " + std::to_string(contribution);
  if (found.contributor != contributor)
    return Status::InvalidArgument(what + " is not one of " + contributor);
  if (found.closed_unix_s != 0) return Status::AlreadyExists(what + " is closed: open another one");
  if (found.photo_count >= kPhotosMax)
    return Status::AlreadyExists(what + " has " + std::to_string(kPhotosMax) +
                                 " photos, the most that one may have: open another one");
  return Status::Ok();
}

Status EngineParts::RemoveContributions(const RemoveRequest& request) {
  Writer::Turn turn = writer->Take();
  const std::lock_guard lock(lining_mutex);
  const WriteScope scope = BeginWrite(&turn.database());
  std::vector<uint32_t> numbers;
  VEDUTA_RETURN_IF_ERROR(
      scope.base->contributing().ScanContributions(1, [&](const ContributionRecord& contribution) {
        if (request.contribution != 0 ? contribution.number == request.contribution
                                      : contribution.contributor == request.contributor)
          numbers.push_back(contribution.number);
        return true;
      }));
  if (numbers.empty()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  for (const uint32_t number : numbers) {
    scope.transaction->RemoveContribution(number);
    AppendJournal({0, 0, request.actor, kAction, {}, {}, "removed " + std::to_string(number)},
                  &state, scope.transaction.get());
  }
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

}  // namespace veduta
