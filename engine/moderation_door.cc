// SPDX-License-Identifier: Apache-2.0
// The members of Engine and of Questions about what curators hide and people report.
#include <algorithm>
#include <ctime>
#include <functional>
#include <utility>

#include "engine/engine.h"
#include "engine/ingest/write_scope.h"
#include "engine/journal/journal.h"
#include "engine/parts.h"
#include "engine/query/find_image.h"
#include "storage/base/plain_text.h"

namespace veduta {
namespace {

constexpr size_t kTextBytesMax = 2000;

constexpr std::pair<ReportReason, const char*> kReasons[] = {
    {ReportReason::kPrivacy, "privacy"},
    {ReportReason::kCopyright, "copyright"},
    {ReportReason::kOffensive, "offensive"},
    {ReportReason::kWrong, "wrong"},
    {ReportReason::kOther, "other"}};

Status CheckText(const char* what, const std::string& text) {
  if (text.size() > kTextBytesMax)
    return Status::InvalidArgument(std::string(what) + " has " + std::to_string(text.size()) +
                                   " bytes, but must have at most " +
                                   std::to_string(kTextBytesMax));
  if (IsPlainText(text, /*may_have_lines=*/true)) return Status::Ok();
  return Status::InvalidArgument(std::string(what) + " is no UTF-8, or has control characters");
}

std::string TextOf(const HiddenRecord& hidden) {
  return (hidden.kind == HiddenKind::kImage ? "image " : "contribution ") +
         std::to_string(hidden.number);
}

// What the request names, each once.
Result<std::vector<HiddenRecord>> FactsOf(const Snapshot& snapshot, const HideRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  HiddenRecord fact;
  fact.time_unix_s = std::time(nullptr);
  fact.actor = request.actor;
  fact.reason = request.reason;
  if (request.contribution != 0) {
    fact.kind = HiddenKind::kContribution;
    fact.number = request.contribution;
    VEDUTA_ASSIGN_OR_RETURN(const auto found,
                            snapshot.contributing().FindContribution(fact.number));
    if (!found) return Status::NotFound("there is no " + TextOf(fact));
    return std::vector<HiddenRecord>{fact};
  }
  std::vector<HiddenRecord> facts;
  for (const std::string& photo : request.photos) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(snapshot, photo));
    fact.number = image.id.value;
    if (std::ranges::find(facts, fact.number, &HiddenRecord::number) == facts.end())
      facts.push_back(fact);
  }
  return facts;
}

// Reports of what is hidden now have done their work.
Status ResolveReports(const Snapshot& snapshot, const HiddenRecord& hidden,
                      Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReportRecord> reports, snapshot.moderation().ListReports());
  for (ReportRecord& report : reports) {
    if (report.state != ReportState::kOpen) continue;
    const Result<ImageRecord> image = snapshot.GetImage(report.image);
    if (image.status().code() == StatusCode::kNotFound) continue;  // a repair has lost it
    VEDUTA_RETURN_IF_ERROR(image.status());
    const uint32_t number =
        hidden.kind == HiddenKind::kImage ? image->id.value : image->contribution;
    if (number != hidden.number) continue;
    report.state = ReportState::kHidden;
    report.resolver = hidden.actor;
    report.resolved_unix_s = hidden.time_unix_s;
    transaction->PutReport(report);
  }
  return Status::Ok();
}

void NoteFact(const HiddenRecord& fact, const char* action, DatabaseState* state,
              Transaction* transaction) {
  const ImageId image(fact.kind == HiddenKind::kImage ? fact.number : 0);
  const std::string reason = fact.reason.empty() ? "" : ": " + fact.reason;
  AppendJournal({0, 0, fact.actor, action, image, {}, TextOf(fact) + reason}, state, transaction);
}

// Why the fact cannot be taken back: it is none.
Result<std::string> WhyNotHidden(const Snapshot& snapshot, const HiddenRecord& fact) {
  const std::string none = TextOf(fact) + " is not hidden";
  if (fact.kind != HiddenKind::kImage) return none;
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(ImageId(fact.number)));
  VEDUTA_ASSIGN_OR_RETURN(const bool is_hidden, IsHidden(snapshot, image));
  if (!is_hidden) return none;
  const std::string contribution = std::to_string(image.contribution);
  return none + " by itself: its contribution " + contribution + " is";
}

// The name of an image; empty where it was removed.
Result<std::string> NameOf(const Snapshot& snapshot, ImageId id) {
  Result<ImageRecord> image = snapshot.GetImage(id);
  if (image.status().code() == StatusCode::kNotFound) return std::string();
  VEDUTA_RETURN_IF_ERROR(image.status());
  return std::move(image->name);
}

}  // namespace

std::string ReportReasonWord(ReportReason reason) {
  const auto found =
      std::ranges::find(kReasons, reason, &std::pair<ReportReason, const char*>::first);
  return found == std::end(kReasons) ? "unknown" : found->second;
}

Result<ReportReason> ParseReportReason(const std::string& word) {
  for (const auto& [reason, name] : kReasons) {
    if (word == name) return reason;
  }
  return Status::InvalidArgument("the reason is '" + word +
                                 "', and must be privacy, copyright, offensive, wrong or other");
}

std::string ReportStateWord(ReportState state) {
  switch (state) {
    case ReportState::kOpen:
      return "open";
    case ReportState::kDismissed:
      return "dismissed";
    case ReportState::kHidden:
      return "hidden";
    case ReportState::kErased:
      break;
  }
  return "erased";
}

Status HideRequest::Check() const {
  if (photos.empty() == (contribution == 0))
    return Status::InvalidArgument("name photos, or a contribution, and not both");
  return CheckText("the reason", reason);
}

Status ReportRequest::Check() const {
  if (reason < ReportReason::kPrivacy || reason > ReportReason::kOther)
    return Status::InvalidArgument("the reason is none of the five");
  return CheckText("the text", text);
}

Status Engine::Hide(const HideRequest& request) {
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(std::vector<HiddenRecord> facts, FactsOf(*scope.base, request));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  for (const HiddenRecord& fact : facts) {
    VEDUTA_ASSIGN_OR_RETURN(const bool is_known,
                            scope.base->moderation().IsHidden(fact.kind, fact.number));
    if (is_known) continue;
    scope.transaction->PutHidden(fact);
    VEDUTA_RETURN_IF_ERROR(ResolveReports(*scope.base, fact, scope.transaction.get()));
    NoteFact(fact, "hide", &state, scope.transaction.get());
  }
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Status Engine::Unhide(const HideRequest& request) {
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(std::vector<HiddenRecord> facts, FactsOf(*scope.base, request));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  for (const HiddenRecord& fact : facts) {
    VEDUTA_ASSIGN_OR_RETURN(const bool is_known,
                            scope.base->moderation().IsHidden(fact.kind, fact.number));
    if (!is_known) {
      VEDUTA_ASSIGN_OR_RETURN(const std::string why, WhyNotHidden(*scope.base, fact));
      return Status::NotFound(why);
    }
    scope.transaction->DeleteHidden(fact.kind, fact.number);
    NoteFact(fact, "unhide", &state, scope.transaction.get());
  }
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Result<uint32_t> Engine::Report(const ReportRequest& request, const Sight& sight) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*scope.base, request.photo, sight));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReportRecord> all,
                          scope.base->moderation().ListReports());
  size_t open = 0;
  for (const ReportRecord& report : all) {
    if (report.state != ReportState::kOpen) continue;
    if (report.image == image.id && report.reporter == request.reporter) return report.number;
    ++open;
  }
  if (open >= kOpenReportsMax)
    return Status::Busy("too many reports wait for a curator: come again later");
  ReportRecord report;
  report.number = all.empty() ? 1 : all.back().number + 1;
  report.image = image.id;
  report.reason = request.reason;
  report.text = request.text;
  report.reporter = request.reporter;
  report.time_unix_s = std::time(nullptr);
  scope.transaction->PutReport(report);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  AppendJournal(
      {0,
       0,
       request.reporter,
       "report",
       image.id,
       {},
       "report " + std::to_string(report.number) + ": " + ReportReasonWord(report.reason)},
      &state, scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  return report.number;
}

Status Engine::DismissReport(uint32_t number, const std::string& actor) {
  Writer::Turn turn = parts_->writer->Take();
  const WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(std::optional<ReportRecord> report,
                          scope.base->moderation().FindReport(number));
  if (!report) return Status::NotFound("there is no report " + std::to_string(number));
  if (report->state != ReportState::kOpen)
    return Status::AlreadyExists("report " + std::to_string(number) +
                                 " was resolved before: " + ReportStateWord(report->state));
  report->state = ReportState::kDismissed;
  report->resolver = actor;
  report->resolved_unix_s = std::time(nullptr);
  scope.transaction->PutReport(*report);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  AppendJournal({0, 0, actor, "dismiss", report->image, {}, "report " + std::to_string(number)},
                &state, scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Status Engine::NoteTokenUse(std::span<const TokenUse> uses) {
  return parts_->database->PutTokenUse(uses);
}

Result<std::vector<TokenUse>> Questions::TokenUses() const {
  return view_->snapshot->moderation().ListTokenUse();
}

Result<std::vector<HiddenAnswer>> Questions::Hidden() const {
  const Snapshot& snapshot = *view_->snapshot;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HiddenRecord> all, snapshot.moderation().ListHidden());
  std::vector<HiddenAnswer> answers;
  for (const HiddenRecord& record : all) {
    HiddenAnswer& answer = answers.emplace_back();
    answer.kind = record.kind;
    answer.number = record.number;
    answer.time_unix_s = record.time_unix_s;
    answer.actor = record.actor;
    answer.reason = record.reason;
    if (record.kind != HiddenKind::kImage) continue;
    VEDUTA_ASSIGN_OR_RETURN(answer.name, NameOf(snapshot, ImageId(record.number)));
  }
  return answers;
}

Result<std::vector<ReportAnswer>> Questions::Reports(bool open_only) const {
  const Snapshot& snapshot = *view_->snapshot;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReportRecord> all, snapshot.moderation().ListReports());
  std::vector<ReportAnswer> answers;
  for (ReportRecord& record : all) {
    if (open_only && record.state != ReportState::kOpen) continue;
    VEDUTA_ASSIGN_OR_RETURN(std::string name, NameOf(snapshot, record.image));
    answers.push_back({record.number, record.image, std::move(name), record.reason,
                       std::move(record.text), std::move(record.reporter), record.time_unix_s,
                       record.state, std::move(record.resolver), record.resolved_unix_s});
  }
  return answers;
}

Result<bool> Questions::Sees(ImageId image) const {
  return view_->visibility().Sees(image);
}

Result<bool> Questions::SeesUpload(uint64_t number) const {
  const Result<UploadRecord> upload = view_->snapshot->GetUpload(number);
  if (upload.status().code() == StatusCode::kNotFound) return true;
  VEDUTA_RETURN_IF_ERROR(upload.status());
  if (upload->contribution == 0) return true;
  return view_->visibility().SeesContribution(upload->contribution);
}

Result<AddOutcome> Questions::Told(AddOutcome outcome) const {
  if (!outcome.duplicate || !outcome.id.valid()) return outcome;
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, view_->visibility().Sees(outcome.id));
  if (sees) return outcome;
  outcome.id = {};
  outcome.reconstruction = {};
  outcome.detail = "the same bytes are stored";
  return outcome;
}

}  // namespace veduta
