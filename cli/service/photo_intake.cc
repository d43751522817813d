// SPDX-License-Identifier: Apache-2.0
#include "cli/service/photo_intake.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include "cli/wire/added_json.h"

namespace veduta {
namespace {

// Bounds of Retry-After, in seconds. Chosen by hand.
constexpr double kRetryMinS = 1, kRetryMaxS = 60;

// What is stored and has a place, or may get one, is 201; the rest is a problem that holds the
// outcome.
HttpAnswer AnswerOf(const AddOutcome& outcome) {
  HttpAnswer answer;
  if (outcome.duplicate || outcome.verdict == Verdict::kRejected) {
    answer = Problem(outcome.duplicate ? 409 : 422, OutcomeReason(outcome), ToJson(outcome));
  } else {
    answer = JsonAnswer(201, ToJson(outcome));
  }
  if (outcome.id.valid()) {
    // "#" and the number, encoded: names may be there twice.
    answer.headers.emplace_back("Location", "/v1/photos/%23" + std::to_string(outcome.id.value));
  }
  return answer;
}

// Nothing is stored of a photo that the disk refused, and another time it may take it.
HttpAnswer FailureAnswer(const Status& status) {
  if (status.code() != StatusCode::kIoError) return ProblemOf(status);
  return ProblemOf(
      Status::Busy("the photo cannot be stored now, send it again later: " + status.message()));
}

}  // namespace

struct PhotoIntake::Arrival {
  std::string name, contributor;
  Answered answered;
  uint64_t number = 0;     // of its ticket, once that is known
  bool has_ended = false;  // both are guarded by the intake's mutex
};

std::optional<HttpAnswer> PhotoIntake::TakePlace(const std::string& contributor) {
  const std::lock_guard lock(mutex_);
  if (is_closing_)
    return ProblemOf(Status::Busy("the daemon is closing: send the photo again in a while"));
  const bool is_half_full = 2 * counts_.waiting >= waiting_max_;
  if (counts_.waiting < waiting_max_ && !(is_half_full && places_.contains(contributor))) {
    ++places_[contributor];
    ++counts_.waiting;
    return std::nullopt;
  }
  uint64_t ended = 0;
  for (const auto& [word, count] : counts_.ended) ended += count;
  const double each_s = counts_.seconds / static_cast<double>(std::max<uint64_t>(ended, 1));
  // By then half of those that wait have had their turn.
  const double wait_s = each_s * static_cast<double>(counts_.waiting) / 2;
  HttpAnswer full = Problem(429, std::to_string(counts_.waiting) +
                                     " photos wait for their turn, and no more of yours may; "
                                     "nothing of this one is stored: send it again later");
  full.headers.emplace_back(
      "Retry-After",
      std::to_string(static_cast<uint32_t>(std::clamp(wait_s, kRetryMinS, kRetryMaxS))));
  return full;
}

void PhotoIntake::Take(Engine* engine, HttpRequest request, Answered answered) {
  if (auto refusal = RefuseBody(request)) return answered(*std::move(refusal));
  const auto arrival = std::make_shared<Arrival>();
  arrival->name = Parameter(request, "name");
  arrival->contributor = Parameter(request, "contributor", "anonymous");
  if (arrival->name.empty())
    return answered(Problem(400, "the photo has no name: add ?name=IMG_1234.jpg to the address"));
  if (auto refusal = TakePlace(arrival->contributor)) return answered(*std::move(refusal));
  arrival->answered = std::move(answered);
  try {
    Submit(engine, std::move(request), arrival);
  } catch (const std::exception& error) {
    End(arrival.get(), Status::NoMemory(std::string("the photo cannot be taken: ") + error.what()));
  }
}

void PhotoIntake::Submit(Engine* engine, HttpRequest request,
                         const std::shared_ptr<Arrival>& arrival) {
  PhotoSubmission photo{{arrival->name, "", std::move(request.body)},
                        Parameter(request, "camera"),
                        arrival->contributor};
  const Result<Ticket> ticket = engine->Submit(
      std::move(photo),
      [this, arrival](const Result<AddOutcome>& outcome) { End(arrival.get(), outcome); });
  if (!ticket.ok()) return End(arrival.get(), ticket.status());
  bool comes_too_late = false;
  {
    const std::lock_guard lock(mutex_);
    arrival->number = ticket->number();
    if (!arrival->has_ended) waiting_.emplace(arrival->number, Waiting{*ticket, arrival});
    comes_too_late = is_closing_;
  }
  if (comes_too_late) Close();
}

void PhotoIntake::End(Arrival* arrival, const Result<AddOutcome>& outcome) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(arrival->has_ended, true)) return;
    --counts_.waiting;
    if (--places_[arrival->contributor] == 0) places_.erase(arrival->contributor);
    waiting_.erase(arrival->number);
  }
  // Short memory must not end the thread that applies photos. The connection tells of a failure
  // where the answer is never made.
  try {
    {
      const std::lock_guard lock(mutex_);
      ++counts_.ended[outcome.ok() ? OutcomeWord(*outcome) : "failed"];
      if (outcome.ok()) counts_.seconds += outcome->times.total_ms / 1000;
    }
    ended_(arrival->name, outcome);
    arrival->answered(outcome.ok() ? AnswerOf(*outcome) : FailureAnswer(outcome.status()));
  } catch (const std::exception&) {
  }
  arrival->answered = {};
}

// The engine answers cancelled photos too, but late: one after the other, between its steps.
void PhotoIntake::Close() {
  std::vector<Waiting> waiting;
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
    for (const auto& [number, one] : waiting_) waiting.push_back(one);
  }
  for (Waiting& one : waiting) {
    if (one.ticket.Cancel())
      End(one.arrival.get(), Status::Cancelled("the daemon is closing, and nothing of the photo is "
                                               "stored: send it again in a while"));
  }
}

bool PhotoIntake::is_closing() const {
  const std::lock_guard lock(mutex_);
  return is_closing_;
}

PhotoIntake::Counts PhotoIntake::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace veduta
