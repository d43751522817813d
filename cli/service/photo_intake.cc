// SPDX-License-Identifier: Apache-2.0
#include "cli/service/photo_intake.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "cli/service/path_numbers.h"
#include "cli/service/photo_name.h"
#include "cli/wire/added_json.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Bounds of Retry-After, in seconds. Chosen by hand.
constexpr double kRetryMinS = 1, kRetryMaxS = 600;

// Uploads that have had their turn and can still be asked after. Chosen by hand: each is a KB.
constexpr size_t kEndedMax = 10'000;

// With so many photos at once a city's first cameras are looked for, whoever else still sends some:
// a calibration looks at no more (engine/alike_photos.h).
constexpr size_t kCameralessEnough = 1500;
// log2 of the photos that are stored between two tries of one whose camera cannot be told, at most.
constexpr uint32_t kTriesMax = 20;

// What is stored and has a place, or may get one, is 201; what takes the place of a stored photo's
// bytes is 200; the rest is a problem that holds the outcome.
HttpAnswer AnswerOf(const AddOutcome& outcome) {
  HttpAnswer answer;
  if (outcome.replaced) {
    answer = JsonAnswer(200, ToJson(outcome));
  } else if (outcome.duplicate || outcome.verdict == Verdict::kRejected) {
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

// 202: it is on the disk and waits for its turn.
HttpAnswer AcceptedAnswer(const UploadNews& news) {
  HttpAnswer answer = JsonAnswer(202, news.ToJson());
  answer.headers.emplace_back("Location", "/v1/uploads/" + std::to_string(news.number));
  answer.upload = news.number;
  return answer;
}

HttpAnswer AnswerOf(const UploadNews& news) {
  if (!news.ended) return AcceptedAnswer(news);
  HttpAnswer answer = news.ended->ok() ? AnswerOf(**news.ended) : ProblemOf(news.ended->status());
  answer.upload = news.number;
  return answer;
}

// Whether the photo is on the disk all the same, and has its turn later: see Ticket::Wait.
bool IsPutOff(const Status& failure) {
  return failure.code() == StatusCode::kIoError || failure.code() == StatusCode::kBusy ||
         failure.code() == StatusCode::kNoMemory || failure.code() == StatusCode::kNotFound;
}

// Of a photo, which may be missing, and of the one it is sent for.
Status CheckNames(const std::string& photo, const std::string& contributor) {
  if (!photo.empty()) VEDUTA_RETURN_IF_ERROR(CheckPhotoName(photo));
  return CheckName("the name of a contributor", contributor);
}

}  // namespace

Status IntakeLimits::Check() const {
  return OptionBounds()
      .Between("photos_max", photos_max, 1, 1'000'000)
      .AtLeast("bytes_max", static_cast<double>(bytes_max), 1)
      .status();
}

Json UploadNews::ToJson() const {
  const bool is_done = ended && ended->ok();
  return {{"upload", number},
          {"image", name},
          {"contributor", contributor},
          {"state", !ended    ? "waiting"
                    : is_done ? "done"
                              : "failed"},
          {"outcome", is_done ? veduta::ToJson(**ended) : Json()},
          {"why_not", why_not.empty() ? Json() : Json(why_not)},
          {"awaits_camera", awaits_camera}};
}

struct PhotoIntake::Upload {
  Upload(std::string name_of_it, std::string sender, uint64_t size)
      : name(std::move(name_of_it)), contributor(std::move(sender)), size_bytes(size) {}

  struct Listener {
    UploadHeard heard;
    std::optional<std::weak_ptr<const void>> waiting;

    bool has_left() const { return waiting && waiting->expired(); }
  };

  const std::string name, contributor;
  const uint64_t size_bytes;
  // The rest is guarded by the intake's mutex.
  uint64_t number = 0;     // once it is known
  bool is_in_line = true;  // false: it is put off, and waits on the disk until Resume
  bool awaits_camera = false;
  uint32_t tries = 0;      // after which it awaited its camera
  uint64_t try_again = 0;  // once so many photos are stored
  std::optional<Result<AddOutcome>> ended;
  std::string why_not;          // why its turn has failed, or has not come
  std::vector<Listener> heard;  // those who wait
  size_t look_at = 16;          // so many of them, for some may have left

  UploadNews news() const { return {number, name, contributor, ended, why_not, awaits_camera}; }
};

std::optional<HttpAnswer> PhotoIntake::TakePlace(const Upload& upload) {
  const std::lock_guard lock(mutex_);
  std::optional<HttpAnswer> refusal = CheckPlace(upload.contributor, upload.size_bytes);
  if (!refusal) AddPlace(upload);
  return refusal;
}

std::optional<HttpAnswer> PhotoIntake::RefuseFull(const std::string& contributor,
                                                  uint64_t size_bytes) const {
  const std::lock_guard lock(mutex_);
  return CheckPlace(contributor, size_bytes);
}

std::optional<HttpAnswer> PhotoIntake::CheckPlace(const std::string& contributor,
                                                  uint64_t size_bytes) const {
  if (is_closing_)
    return ProblemOf(Status::Busy("the daemon is closing: send the photo again in a while"));
  const bool is_half_full =
      2 * counts_.waiting >= limits_.photos_max || 2 * counts_.waiting_bytes >= limits_.bytes_max;
  // Those that came in parts may be more than there is room for.
  const bool has_room = counts_.waiting < limits_.photos_max &&
                        counts_.waiting_bytes <= limits_.bytes_max &&
                        size_bytes <= limits_.bytes_max - counts_.waiting_bytes;
  if (has_room && !(is_half_full && places_.contains(contributor))) return std::nullopt;
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

void PhotoIntake::AddPlace(const Upload& upload) {
  ++places_[upload.contributor];
  ++counts_.waiting;
  counts_.waiting_bytes += upload.size_bytes;
  last_change_ = std::chrono::steady_clock::now();
  changed_.notify_all();
}

void PhotoIntake::GivePlace(const Upload& upload) {
  --counts_.waiting;
  counts_.waiting_bytes -= upload.size_bytes;
  if (--places_[upload.contributor] == 0) places_.erase(upload.contributor);
  last_change_ = std::chrono::steady_clock::now();
  changed_.notify_all();
}

void PhotoIntake::SetInLine(Upload* upload, bool is_in_line) {
  if (upload->is_in_line == is_in_line) return;
  upload->is_in_line = is_in_line;
  if (!is_in_line) {
    ++put_off_;
    return;
  }
  --put_off_;
  upload->why_not.clear();
  if (std::exchange(upload->awaits_camera, false)) --counts_.awaiting_camera;
}

void PhotoIntake::PutOff(Upload* upload, const Status& why) {
  SetInLine(upload, false);
  upload->why_not = why.message();
  if (why.code() == StatusCode::kNotFound && !upload->awaits_camera) {
    upload->awaits_camera = true;
    ++counts_.awaiting_camera;
    upload->try_again = stored_ + (uint64_t{1} << std::min(upload->tries++, kTriesMax));
  }
  last_change_ = std::chrono::steady_clock::now();
  changed_.notify_all();
}

void PhotoIntake::EndUpload(Upload* upload, const Result<AddOutcome>& outcome) {
  SetInLine(upload, true);
  if (!outcome.ok()) upload->why_not = outcome.status().message();
  upload->ended = outcome;
  ++counts_.ended[outcome.ok() ? OutcomeWord(*outcome) : "failed"];
  if (outcome.ok()) counts_.seconds += outcome->times.total_ms / 1000;
  if (outcome.ok() && outcome->id.valid() && !outcome->duplicate) ++stored_;
  GivePlace(*upload);
  if (upload->number != 0) NoteEnded(upload->number);
}

void PhotoIntake::Take(Engine* engine, HttpRequest request, Answered answered) {
  if (auto refusal = RefuseBody(request)) return answered(*std::move(refusal));
  const std::string name = Parameter(request, "name");
  if (!request.is_of_owner) {  // the owner may have files of any name
    const Status named = CheckNames(name, Parameter(request, "contributor"));
    if (!named.ok()) return answered(ProblemOf(named));
  }
  uint32_t contribution = 0;
  std::string sender = request.who.empty() ? "anonymous" : request.who;
  if (const std::string text = Parameter(request, "contribution"); !text.empty()) {
    const Result<uint32_t> number = ContributionNumber(text);
    if (!number.ok()) return answered(ProblemOf(number.status()));
    contribution = *number;
    const auto of_all = engine->Ask().Contribution(contribution);
    if (!of_all.ok()) return answered(ProblemOf(of_all.status()));
    if (request.may_name_others) sender = of_all->contributor;
  }
  PhotoSubmission photo{{name, "", std::move(request.body)},
                        Parameter(request, "camera"),
                        Parameter(request, "contributor", sender),
                        contribution};
  UploadNews news;
  news.name = photo.photo.name;
  news.contributor = photo.contributor;
  auto accepted = Accept(engine, std::move(photo));
  if (auto* const refusal = std::get_if<HttpAnswer>(&accepted))
    return answered(std::move(*refusal));
  news.number = std::get<uint64_t>(accepted);
  if (request.prefers_async) {
    HttpAnswer answer = AcceptedAnswer(news);
    answer.headers.emplace_back("Preference-Applied", "respond-async");
    return answered(std::move(answer));
  }
  const auto heard = [answered, engine, sight = request.sight](UploadNews told) {
    if (told.ended && told.ended->ok()) told.ended = engine->Ask(sight).Told(**told.ended);
    answered(AnswerOf(told));
  };
  if (auto unknown = Await(news.number, heard)) answered(*std::move(unknown));
}

std::variant<uint64_t, HttpAnswer> PhotoIntake::Accept(Engine* engine, PhotoSubmission photo) {
  const auto upload = std::make_shared<Upload>(photo.photo.name, photo.contributor,
                                               photo.photo.bytes ? photo.photo.bytes->size() : 0);
  if (upload->name.empty())
    return Problem(400, "the photo has no name: add ?name=IMG_1234.jpg to the address");
  if (auto refusal = TakePlace(*upload)) return *std::move(refusal);
  Result<Ticket> ticket = Status::Cancelled("not submitted");
  try {
    ticket = engine->Submit(std::move(photo),
                            [this, upload](const auto& outcome) { End(upload, outcome); });
  } catch (const std::exception& error) {
    ticket = Status::NoMemory(std::string("the photo cannot be taken: ") + error.what());
  }
  if (ticket.ok()) {
    Enter(ticket->number(), upload);
    return ticket->number();
  }
  {
    const std::lock_guard lock(mutex_);
    GivePlace(*upload);
    ++counts_.ended["failed"];
  }
  ended_(0, upload->name, ticket.status());
  // Nothing is stored of a photo that the disk refuses, and another time it may take it.
  if (ticket.status().code() != StatusCode::kIoError) return ProblemOf(ticket.status());
  return ProblemOf(Status::Busy("the photo cannot be stored now, send it again later: " +
                                ticket.status().message()));
}

std::optional<HttpAnswer> PhotoIntake::Await(uint64_t upload, UploadHeard heard,
                                             std::optional<std::weak_ptr<const void>> waiting) {
  UploadNews news;
  {
    const std::lock_guard lock(mutex_);
    const auto found = uploads_.find(upload);
    if (found == uploads_.end()) return UnknownUpload(upload);
    Upload& known = *found->second;
    if (!known.ended && known.is_in_line && !is_closing_) {
      // Whoever asks and leaves, again and again, is kept once.
      if (known.heard.size() >= known.look_at) {
        std::erase_if(known.heard, &Upload::Listener::has_left);
        known.look_at = std::max<size_t>(16, 2 * known.heard.size());
      }
      known.heard.push_back({std::move(heard), std::move(waiting)});
      return std::nullopt;
    }
    news = known.news();
  }
  heard(news);
  return std::nullopt;
}

Result<PartialUploadAnswer> PhotoIntake::Continue(Engine* engine, const std::string& id,
                                                  uint64_t offset, std::span<const uint8_t> bytes) {
  VEDUTA_ASSIGN_OR_RETURN(const PartialUploadAnswer before, engine->Ask().PartialUpload(id));
  if (bytes.empty() || offset + bytes.size() != before.length_bytes)
    return engine->ContinueUpload(id, offset, bytes);
  const auto upload =
      std::make_shared<Upload>(before.name, before.contributor, before.length_bytes);
  {
    const std::lock_guard lock(mutex_);
    if (is_closing_) return Status::Busy("the daemon is closing: go on in a while");
    AddPlace(*upload);
  }
  const Result<PartialUploadAnswer> after = engine->ContinueUpload(
      id, offset, bytes, [this, upload](const auto& outcome) { End(upload, outcome); });
  if (after.ok() && after->upload != 0) {
    if (!after->is_in_line) {
      const std::lock_guard lock(mutex_);
      SetInLine(upload.get(), false);
    }
    Enter(after->upload, upload);
  } else {
    const std::lock_guard lock(mutex_);
    GivePlace(*upload);
  }
  return after;
}

void PhotoIntake::Enter(uint64_t number, const std::shared_ptr<Upload>& upload) {
  const std::lock_guard lock(mutex_);
  upload->number = number;
  uploads_[number] = upload;
  if (upload->ended) NoteEnded(number);
}

Status PhotoIntake::Resume(Engine* engine, bool with_all_cameraless) {
  const std::vector<uint64_t> put_off = ListPutOff();  // before the disk is read
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<UploadAnswer> waiting, engine->Ask().Uploads());
  ForgetGone(put_off, waiting);
  Status first_failure;
  for (const UploadAnswer& one : waiting) {
    const Status resumed = ResumeOne(engine, one, with_all_cameraless);
    if (first_failure.ok()) first_failure = resumed;
  }
  return first_failure;
}

Status PhotoIntake::ResumeOne(Engine* engine, const UploadAnswer& one, bool with_all_cameraless) {
  std::shared_ptr<Upload> upload;
  {
    const std::lock_guard lock(mutex_);
    if (is_closing_) return Status::Ok();
    std::shared_ptr<Upload>& known = uploads_[one.number];
    if (known && (known->is_in_line || known->ended)) return Status::Ok();
    if (known && known->awaits_camera && !with_all_cameraless && stored_ < known->try_again)
      return Status::Ok();
    if (!known) {
      known = std::make_shared<Upload>(one.name, one.contributor, one.size_bytes);
      known->number = one.number;
      AddPlace(*known);
    }
    SetInLine(known.get(), true);
    upload = known;
  }
  const Result<Ticket> ticket =
      engine->Resume(one.number, [this, upload](const auto& outcome) { End(upload, outcome); });
  if (ticket.ok()) return Status::Ok();
  const std::lock_guard lock(mutex_);
  // It has had its turn long ago, or has just come and is about to be entered.
  if (ticket.status().code() == StatusCode::kNotFound ||
      ticket.status().code() == StatusCode::kAlreadyExists) {
    GivePlace(*upload);
    if (uploads_[one.number] == upload) uploads_.erase(one.number);
    return Status::Ok();
  }
  PutOff(upload.get(), ticket.status());
  return ticket.status();
}

std::vector<uint64_t> PhotoIntake::ListPutOff() const {
  const std::lock_guard lock(mutex_);
  std::vector<uint64_t> numbers;
  for (const auto& [number, upload] : uploads_) {
    if (!upload->is_in_line && !upload->ended) numbers.push_back(number);
  }
  return numbers;
}

void PhotoIntake::ForgetGone(const std::vector<uint64_t>& put_off,
                             const std::vector<UploadAnswer>& on_disk) {
  const std::lock_guard lock(mutex_);
  for (const uint64_t number : put_off) {
    const auto found = uploads_.find(number);
    if (found == uploads_.end() || found->second->is_in_line || found->second->ended) continue;
    if (std::ranges::binary_search(on_disk, number, {}, &UploadAnswer::number)) continue;
    const std::shared_ptr<Upload> upload = found->second;
    EndUpload(upload.get(), Status::NotFound("it does not wait any more: " + upload->why_not));
  }
}

size_t PhotoIntake::AwaitCameraless(size_t count_min, std::chrono::seconds quiet,
                                    const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto are_enough = [&] { return counts_.awaiting_camera >= count_min; };
  while (!stop.stop_requested()) {
    if (!changed_.wait(lock, stop, are_enough)) break;
    const bool is_quiet =
        counts_.waiting == put_off_ && std::chrono::steady_clock::now() >= last_change_ + quiet;
    if (is_quiet || counts_.awaiting_camera >= std::max(count_min, kCameralessEnough))
      return counts_.awaiting_camera;
    changed_.wait_for(lock, stop, quiet, [] { return false; });
  }
  return 0;
}

std::optional<UploadNews> PhotoIntake::News(uint64_t upload) const {
  const std::lock_guard lock(mutex_);
  const auto found = uploads_.find(upload);
  if (found == uploads_.end()) return std::nullopt;
  return found->second->news();
}

HttpAnswer PhotoIntake::Find(uint64_t upload) const {
  const std::optional<UploadNews> news = News(upload);
  return news ? JsonAnswer(200, news->ToJson()) : UnknownUpload(upload);
}

HttpAnswer PhotoIntake::UnknownUpload(uint64_t upload) {
  return Problem(404, "nothing is known of upload " + std::to_string(upload) +
                          ": where it was stored, the SHA-256 of its photo finds it, as "
                          "/v1/photos/SHA256");
}

void PhotoIntake::End(const std::shared_ptr<Upload>& upload, const Result<AddOutcome>& outcome) {
  std::vector<Upload::Listener> heard;
  UploadNews news;
  // Short memory must not end the thread that applies photos. The connection tells of a failure
  // where the answer is never made.
  try {
    const std::lock_guard lock(mutex_);
    // Those that a closing engine has not come to wait on, and Close has answered them.
    if (is_closing_ && outcome.status().code() == StatusCode::kCancelled) return;
    if (!outcome.ok() && IsPutOff(outcome.status())) {
      PutOff(upload.get(), outcome.status());
    } else {
      EndUpload(upload.get(), outcome);
    }
    heard = std::exchange(upload->heard, {});
    news = upload->news();
  } catch (const std::exception&) {
  }
  try {
    ended_(news.number, upload->name, outcome);
    for (const Upload::Listener& one : heard) one.heard(news);
  } catch (const std::exception&) {
  }
}

void PhotoIntake::NoteEnded(uint64_t number) {
  ended_uploads_.insert(number);
  while (ended_uploads_.size() > kEndedMax) {
    uploads_.erase(*ended_uploads_.begin());
    ended_uploads_.erase(ended_uploads_.begin());
  }
}

void PhotoIntake::Close() {
  std::vector<std::pair<UploadHeard, UploadNews>> told;
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
    for (const auto& [number, upload] : uploads_) {
      for (Upload::Listener& one : std::exchange(upload->heard, {}))
        told.emplace_back(std::move(one.heard), upload->news());
    }
  }
  for (const auto& [heard, news] : told) heard(news);
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
