// SPDX-License-Identifier: Apache-2.0
#include "cli/service/city_service.h"

#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "cli/service/accepted_type.h"
#include "cli/service/byte_range.h"
#include "cli/service/contribution_routes.h"
#include "cli/service/moderation_routes.h"
#include "cli/service/path_numbers.h"
#include "cli/service/photo_form.h"
#include "cli/service/told_upload.h"
#include "cli/service/tus_message.h"
#include "cli/wire/answers_json.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Entries of the journal that are read at once for one who follows it. Chosen by hand.
constexpr uint32_t kEventsMax = 256;

// Damages that are told while the daemon runs. Chosen by hand.
constexpr size_t kDamagesMax = 1000;

std::string RandomName() {
  std::random_device random;
  return std::to_string((uint64_t{random()} << 32) | random());
}

// Whoever sees other photos, or wants another form, is told other things of one snapshot.
std::string TagOf(const HttpRequest& request) {
  const Sight& sight = request.sight;
  std::string tag = PrefersGeoPose(HeaderOf(request, "Accept")) ? "-geopose" : "";
  if (sight.contribution != 0) tag += "-c" + std::to_string(sight.contribution);
  if (sight.reconstruction.valid()) tag += "-r" + std::to_string(sight.reconstruction.value);
  return sight.sees_hidden ? tag + "-all" : tag;
}

// A question is asked once more where the files were opened again while it was answered, as by a
// removal.
HttpAnswer AnswerOfRoute(Engine* engine, const HttpRequest& request, const RouteMatch& match) {
  HttpAnswer answer = match.route->answer(engine, request, match.arguments);
  if (answer.code != 503 || request.method != "GET") return answer;
  return match.route->answer(engine, request, match.arguments);
}

// Why a task is not done.
Status RefusalOf(WorkTurn turn) {
  switch (turn) {
    case WorkTurn::kCome:
      return Status::Ok();
    case WorkTurn::kClientGone:
      return Status::Cancelled("nobody waited for it when its turn came");
    case WorkTurn::kClosed:
      return Status::Busy("the daemon is closing: ask again in a while");
    case WorkTurn::kFull:
      return Status::Busy("too many questions wait: ask again in a while");
    case WorkTurn::kFullOfOne:
      return Status::Busy("too many questions of yours wait: ask again when they are answered");
  }
  return Status::Ok();
}

HttpAnswer AnswerToRefused(WorkTurn turn) {
  const Status refusal = RefusalOf(turn);
  if (turn == WorkTurn::kClientGone) return Problem(kClientGoneCode, refusal.message());
  if (turn == WorkTurn::kFullOfOne) return ComeAgain(429, refusal.message(), 1);
  return ProblemOf(refusal);
}

// One sample, in the text format of Prometheus.
std::string Sample(const std::string& name, const std::string& labels, uint64_t value) {
  return name + labels + " " + std::to_string(value) + "\n";
}

std::string Head(const std::string& name, const char* type, const char* help) {
  return "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n";
}

std::string CityMetrics(const StatusAnswer& city) {
  const std::string images = "veduta_images", bytes = "veduta_database_bytes";
  return Head(images, "gauge", "Stored photos.") +
         Sample(images, "{verdict=\"placed\"}", city.placed) +
         Sample(images, "{verdict=\"postponed\"}", city.postponed) +
         Sample(images, "{verdict=\"rejected\"}", city.rejected) +
         Head("veduta_reconstructions", "gauge", "Reconstructions that live.") +
         Sample("veduta_reconstructions", "", city.reconstructions.size()) +
         Head(bytes, "gauge", "Bytes of the database on disk.") +
         Sample(bytes, "", city.total_bytes);
}

// Whether the request, where it fails by the disk, fails by a write of the database: others read or
// write files besides, or tell of it themselves.
bool WritesRecords(const HttpRequest& request) {
  static const std::set<std::string> kWriting = {
      "allowed", "cameras",  "contributions", "densify", "forbidden", "georeference", "hidden",
      "models",  "removals", "reports",       "settle",  "tokens",    "vocabulary"};
  return request.method != "GET" && request.path.size() > 1 && kWriting.contains(request.path[1]);
}

}  // namespace

Status ServiceOptions::Check() const {
  return OptionBounds()
      .Part("intake", intake.Check())
      .Part("tus", tus.Check())
      .Part("dense", dense.Check())
      .Between("query_threads", query_threads, 1, 1024)
      .Between("long_threads", long_threads, 1, 1024)
      .Between("waiting_questions_max", waiting_questions_max, 1, 100'000)
      .Between("waiting_of_one_max", waiting_of_one_max, 1, 100'000)
      .Between("settle_pause_s", settle_pause_s, 1, 86'400)
      .status();
}

CityService::CityService(std::unique_ptr<Engine> engine, const std::string& path,
                         const ServiceOptions& options, Listeners listeners)
    : options_(options),
      damage_met_(std::move(listeners.damage_met)),
      asked_(std::move(listeners.asked)),
      start_(RandomName()),
      intake_(options.intake,
              [this, ended = std::move(listeners.ended)](uint64_t upload, const std::string& name,
                                                         const Result<AddOutcome>& outcome) {
                if (ended) ended(upload, name, outcome);
                if (!outcome.ok()) disk_.NoteFailure(outcome.status());
              }),
      quotas_(options.quota, {.keep =
                                  [this](const TokenUse& use) {
                                    engine_->NoteTokenUse({&use, 1}).IgnoreBecause(
                                        "a token that has used less than it has is no harm");
                                  }}),
      tus_(options.tus, &intake_, &quotas_,
           [this](const Status& failure) { disk_.NoteFailure(failure); }),
      disk_(engine.get(), path,
            [this] {
              Resume().IgnoreBecause("what is not in line is put there after the next pause");
            }),
      engine_(std::move(engine)),
      dense_(engine_.get(), options.dense,
             [this, told = std::move(listeners.dense_failed)](const Status& failure) {
               disk_.NoteFailure(failure);
               if (told) told(failure);
             }),
      cameras_(engine_.get(), &intake_,
               [this](const Status& failure) { disk_.NoteFailure(failure); }),
      owner_commands_(engine_.get(), &dense_, &cameras_, options.dense.request.cache_folder),
      removals_(engine_.get(), &dense_),
      commands_at_work_(kCommandsMax),
      settler_([this, followed = std::move(listeners.followed)](std::stop_token stop) {
        SettleNowAndThen(std::move(stop), followed);
      }),
      work_({options.query_threads, options.long_threads, options.waiting_questions_max,
             options.waiting_of_one_max}) {
  gatekeeper_.Look(engine_->Ask()).IgnoreBecause("the next request reads it");
  // What cannot be read is as little harm.
  if (const auto uses = engine_->Ask().TokenUses(); uses.ok()) quotas_.Restore(*uses);
}

CityService::~CityService() {
  Close();
  settler_.request_stop();  // before tasks that may wait for it are waited for
  disk_.Stop();
}

std::optional<HttpAnswer> CityService::Refuse(HttpRequest* request) const {
  auto found = FindRoute(*request);
  std::optional<HttpAnswer> refusal;
  if (auto* const none = std::get_if<HttpAnswer>(&found)) {
    refusal = std::move(*none);
  } else {
    refusal = gatekeeper_.Refuse(*engine_, *std::get<RouteMatch>(found).route, request);
    if (!refusal) refusal = quotas_.TakeRequest(*request);
  }
  if (refusal && IsTus(*request)) refusal->headers.emplace_back("Tus-Resumable", kTusVersion);
  return refusal;
}

bool CityService::StillAllows(HttpRequest* request) const {
  auto found = FindRoute(*request);
  const auto* const match = std::get_if<RouteMatch>(&found);
  if (match == nullptr) return false;
  const Sight before = request->sight;
  const auto refusal = gatekeeper_.Refuse(*engine_, *match->route, request);
  if (refusal) request->sight = before;  // a link for a part of the city is for no more than that
  return !refusal || refusal->code == 503;  // its token cannot be read now, and is asked for again
}

void CityService::Handle(HttpRequest request, Answered answered) {
  const bool is_get = request.method == "GET";
  // Once it is known.
  struct Whose {
    std::string who, holder;
  };
  const auto whose = std::make_shared<Whose>();
  const Answered counted = [this, is_get, writes = WritesRecords(request),
                            answered = std::move(answered), is_tus = IsTus(request),
                            range = HeaderOf(request, "Range"),
                            if_range = HeaderOf(request, "If-Range"), whose](HttpAnswer answer) {
    if (is_get) CutToRange(range, if_range, &answer);
    // After a failed write nothing is written until the files are opened again.
    if (writes && answer.is_of_disk) disk_.NoteFailure(Status::IoError("a request has failed"));
    Count(answer);
    if (!answer.damages.empty()) TellDamages(answer);
    answer.who = whose->who;
    answer.holder = whose->holder;
    if (is_tus) answer.headers.emplace_back("Tus-Resumable", kTusVersion);
    answered(std::move(answer));
  };
  auto found = FindRoute(request);
  if (auto* const refusal = std::get_if<HttpAnswer>(&found)) return counted(std::move(*refusal));
  const auto match = std::get<RouteMatch>(std::move(found));
  if (auto refusal = gatekeeper_.Refuse(*engine_, *match.route, &request))
    return counted(*std::move(refusal));
  *whose = {request.who, HolderOf(request)};
  if (is_get) {
    if (auto refusal = quotas_.TakeRequest(request)) return counted(*std::move(refusal));
  }
  if (IsQuick(*match.route)) return counted(Answer(request, match));
  const WorkKind kind = WorkKindOf(*match.route);
  if (kind != WorkKind::kCommand) return HandleLater(std::move(request), match, kind, counted);
  if (!commands_at_work_.Take(1))
    return counted(ProblemOf(Status::Busy("two long commands are at work: try again later")));
  HandleLater(std::move(request), match, kind, [this, counted](HttpAnswer answer) {
    commands_at_work_.Give(1);
    counted(std::move(answer));
  });
}

bool CityService::IsQuick(const CityRoute& route) const {
  const bool tells_image =
      route.path.size() > 2 && route.path[1] == "photos" && route.path.back() != "neighbors";
  return route.is_quick && (!tells_image || engine_->Ask().TellsImagesAtOnce());
}

void CityService::HandleLater(HttpRequest request, const RouteMatch& match, WorkKind kind,
                              const Answered& answered) {
  WorkOwner owner{AskerOf(request), request.body.size()};
  // What is stored and what somebody in charge has asked for is done all the same.
  if (kind == WorkKind::kLong) owner.client = request.client;
  // Shared, since tasks are copied, and bodies are large.
  const auto shared = std::make_shared<HttpRequest>(std::move(request));
  const bool is_photo = shared->method == "POST" && shared->path.back() == "photos";
  work_.Add(kind, std::move(owner), [this, shared, match, answered, is_photo](WorkTurn turn) {
    if (turn != WorkTurn::kCome) return answered(AnswerToRefused(turn));
    if (is_photo && shared->content_type == "multipart/form-data")
      return TakeForm(std::move(*shared), answered);
    if (is_photo) return TakePhoto(std::move(*shared), answered);
    answered(Answer(*shared, match));
  });
}

void CityService::Run(WorkKind kind, WorkOwner owner,
                      std::function<void(Engine* engine, const Status& refusal)> task) {
  work_.Add(kind, std::move(owner), [this, task = std::move(task)](WorkTurn turn) {
    task(engine_.get(), RefusalOf(turn));
  });
}

void CityService::TakePhoto(HttpRequest request, const Answered& answered) {
  const uint64_t bytes = request.body.size();
  if (auto refusal = quotas_.TakePhoto(request, bytes)) return answered(*std::move(refusal));
  HttpRequest sender;  // what is left of the request when the photo is judged
  sender.token_number = request.token_number;
  sender.quota = request.quota;
  intake_.Take(engine_.get(), std::move(request),
               [this, sender, bytes, answered](HttpAnswer answer) {
                 if (answer.code == 429 || answer.code == 503) quotas_.GivePhoto(sender, bytes);
                 answered(std::move(answer));
               });
}

void CityService::TakeForm(HttpRequest request, const Answered& answered) {
  const Result<std::vector<FormPhoto>> photos = ReadPhotoForm(&request);
  if (!photos.ok()) return answered(ProblemOf(photos.status()));
  if (auto refusal = Gatekeeper::RefuseNaming(request)) return answered(*std::move(refusal));
  if (photos->size() == 1)
    return TakePhoto(RequestOf(photos->front(), std::move(request)), answered);
  request.prefers_async = true;  // then each is answered before the next one is looked at
  std::vector<std::pair<std::string, HttpAnswer>> answers;
  const Status taken = CatchShortage("take a form", [&] {
    for (const FormPhoto& photo : *photos) {
      TakePhoto(RequestOf(photo, request),
                [&](HttpAnswer answer) { answers.emplace_back(photo.name, std::move(answer)); });
    }
    return Status::Ok();
  });
  // Those that were taken before the memory ran out are told.
  answered(answers.empty() ? ProblemOf(taken) : AnswerToForm(answers));
}

std::variant<uint64_t, HttpAnswer> CityService::AcceptPhoto(const HttpRequest& sender,
                                                            PhotoSubmission photo) {
  const uint64_t bytes = photo.photo.bytes ? photo.photo.bytes->size() : 0;
  if (auto refusal = quotas_.TakePhoto(sender, bytes)) return *std::move(refusal);
  auto accepted = intake_.Accept(engine_.get(), std::move(photo));
  const auto* const refusal = std::get_if<HttpAnswer>(&accepted);
  if (refusal != nullptr && (refusal->code == 429 || refusal->code == 503))
    quotas_.GivePhoto(sender, bytes);
  return accepted;
}

HttpAnswer CityService::Answer(const HttpRequest& request, const RouteMatch& match) {
  const auto answer = CatchShortage("answer a request", [&]() -> Result<HttpAnswer> {
    if (IsTus(request)) return tus_.Answer(engine_.get(), request);
    if (match.route->is_for_owner_alone) return owner_commands_.Answer(request);
    return match.route->answer == nullptr ? AnswerOfItself(request) : AskEngine(request, match);
  });
  return answer.ok() ? *answer : ProblemOf(answer.status());
}

HttpAnswer CityService::AnswerOfItself(const HttpRequest& request) {
  const std::string& asked = request.path.back();
  if (request.path.front() == "v1") {
    if (request.path[1] == "dense") return AnswerOnDense(asked);
    if (request.path[1] != "uploads") return removals_.Answer(request);
    const Result<uint64_t> upload = UploadNumber(asked);
    return upload.ok() ? AnswerOnUpload(*upload, request.sight) : ProblemOf(upload.status());
  }
  if (asked == "metrics") return Metrics();
  if (asked == "healthz") return JsonAnswer(200, {{"status", "alive"}});
  if (intake_.is_closing()) return ProblemOf(Status::Busy("the daemon is closing"));
  const auto journal = engine_->Ask().Journal(1, 1);
  return journal.ok() ? JsonAnswer(200, {{"status", "ready"}}) : ProblemOf(journal.status());
}

HttpAnswer CityService::AnswerOnUpload(uint64_t upload, const Sight& sight) const {
  std::optional<UploadNews> news = intake_.News(upload);
  if (!news) return intake_.Find(upload);
  const Result<UploadNews> told = ToldOf(engine_->Ask(sight), *std::move(news));
  return told.ok() ? JsonAnswer(200, told->ToJson()) : ProblemOf(told.status());
}

HttpAnswer CityService::AnswerOnDense(const std::string& asked) {
  if (asked != "dense") {
    const Status paused = dense_.Pause(asked == "pause");
    if (!paused.ok()) return ProblemOf(paused);
  }
  return JsonAnswer(200, dense_.ToJson());
}

HttpAnswer CityService::Metrics() const {
  const PhotoIntake::Counts photos = intake_.counts();
  const std::string ended = "veduta_photos_total", requests = "veduta_http_requests_total";
  std::string text = Head("veduta_photos_waiting", "gauge", "Photos that wait for their turn.") +
                     Sample("veduta_photos_waiting", "", photos.waiting) +
                     Head("veduta_photos_waiting_bytes", "gauge", "Their bytes.") +
                     Sample("veduta_photos_waiting_bytes", "", photos.waiting_bytes) +
                     Head("veduta_photos_awaiting_camera", "gauge",
                          "Those of them whose camera is not named and cannot be told yet.") +
                     Sample("veduta_photos_awaiting_camera", "", photos.awaiting_camera) +
                     Head(ended, "counter", "Photos that were sent, by what became of them.");
  for (const auto& [word, count] : photos.ended)
    text += Sample(ended, "{outcome=\"" + word + "\"}", count);
  text += Head(requests, "counter", "Requests that were answered, by the code of the answer.");
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [code, count] : answers_)
      text += Sample(requests, "{code=\"" + std::to_string(code) + "\"}", count);
    const std::string calls = "veduta_rpc_calls_total";
    text += Head(calls, "counter",
                 "Calls by RPC, by the request that asks for the same, and whether it was let in.");
    for (const auto& [call, count] : calls_)
      text += Sample(
          calls, "{request=\"" + call.first + "\",code=\"" + std::to_string(call.second) + "\"}",
          count);
  }
  const auto [by_photos, by_others] = engine_->DecoderDeaths();
  const std::string deaths = "veduta_decoder_deaths_total";
  text += Head(deaths, "counter", "Processes that ended on a photo, by the photo or killed.") +
          Sample(deaths, "{cause=\"photo\"}", by_photos) +
          Sample(deaths, "{cause=\"kill\"}", by_others);
  const Result<StatusAnswer> city = engine_->Ask().Status();
  if (!city.ok()) return ProblemOf(city.status());
  HttpAnswer answer;
  answer.content_type = "text/plain; version=0.0.4";
  answer.body = text + CityMetrics(*city);
  return answer;
}

HttpAnswer CityService::AskEngine(const HttpRequest& request, const RouteMatch& match) {
  const CityRoute& route = *match.route;
  if (IsReport(request)) {
    if (auto refusal = quotas_.TakeReport(request)) return *std::move(refusal);
  }
  if (OpensContribution(request)) {
    if (auto refusal = quotas_.TakeContribution(request)) return *std::move(refusal);
  }
  if (!route.is_of_snapshot) {
    HttpAnswer answer = AnswerOfRoute(engine_.get(), request, match);
    if (route.role >= Role::kCurator)  // it may make a token
      gatekeeper_.Look(engine_->Ask()).IgnoreBecause("the next request reads it");
    return answer;
  }
  // Read before the answer is: an answer may be of a later commit than its tag, and is asked for
  // once more then.
  const std::string tag =
      "W/\"" + start_ + "-" + std::to_string(engine_->Ask().snapshot()) + TagOf(request) + "\"";
  HttpAnswer answer;
  if (request.if_none_match == tag) {
    answer.code = 304;
  } else {
    answer = AnswerOfRoute(engine_.get(), request, match);
  }
  if (answer.code < 400) answer.headers.emplace_back("ETag", tag);
  return answer;
}

void CityService::TellEvents(uint64_t first, const Sight& sight,
                             std::function<void(Result<CityEvents>)> told) {
  // All who follow are one, and leave turns and room for questions and photos: they ask again soon.
  work_.Add(WorkKind::kShort, {"events"}, [this, first, sight, told](WorkTurn turn) {
    if (turn == WorkTurn::kClosed) return told(Status::Cancelled("the daemon is closing"));
    if (turn != WorkTurn::kCome) return told(CityEvents{"", first});
    told(CatchShortage("read the journal", [&] { return EventsFrom(first, sight); }));
  });
}

Result<CityEvents> CityService::EventsFrom(uint64_t first, const Sight& sight) const {
  const Result<std::vector<JournalAnswer>> entries = engine_->Ask(sight).Journal(first, kEventsMax);
  CityEvents events{"", first};
  // While the files are opened again, as by a removal, nothing can be read. It is asked again soon.
  if (entries.status().code() == StatusCode::kBusy) return events;
  VEDUTA_RETURN_IF_ERROR(entries.status());
  for (const JournalAnswer& entry : *entries) {
    events.text += "id: " + std::to_string(entry.sequence) +
                   "\nevent: journal\ndata: " + JsonLine(ToJson(entry)) + "\n\n";
    events.next = entry.sequence + 1;
  }
  return events;
}

void CityService::Close() {
  intake_.Close();
  owner_commands_.Stop();
  removals_.Stop();
  work_.Close();
}

void CityService::SettleNowAndThen(
    std::stop_token stop, const std::function<void(const FollowUp&, const Questions&)>& followed) {
  const std::chrono::seconds pause(options_.settle_pause_s);
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      pause_.wait_for(lock, stop, pause, [] { return false; });
    }
    if (stop.stop_requested()) return;
    disk_.Look();
    CatchShortage("resume photos", [&] {
      return Resume();
    }).IgnoreBecause("it is tried again after the next pause");
    CatchShortage("give up uploads", [&] {
      return tus_.Expire(engine_.get());
    }).IgnoreBecause("it is tried again after the next pause");
    const auto tell = [&](const FollowUp& step) {
      if (followed) followed(step, engine_->Ask());
    };
    // Each step that failed was told, and is tried again after the next pause.
    disk_.NoteFailure(CatchShortage("settle", [&] { return engine_->Settle(stop, tell); }));
  }
}

void CityService::TellDamages(const HttpAnswer& answer) {
  for (const std::string& damage : answer.damages) {
    {
      const std::lock_guard lock(mutex_);
      if (damages_.size() >= kDamagesMax || !damages_.insert(damage).second) continue;
    }
    if (damage_met_) damage_met_(damage);
  }
}

void CityService::NoteCall(const HttpRequest& request, uint32_t code) {
  RequestEntry entry;
  entry.id = RequestId("");
  entry.door = "rpc";
  entry.method = request.method;
  entry.route = RouteOf(request);
  entry.who = request.is_of_owner ? "owner" : request.who;
  entry.status = code;
  {
    const std::lock_guard lock(mutex_);
    ++calls_[{entry.method + " " + entry.route, code}];
  }
  if (asked_) asked_(entry);
}

void CityService::Count(const HttpAnswer& answer) {
  const std::lock_guard lock(mutex_);
  ++answers_[answer.code];
}

}  // namespace veduta
