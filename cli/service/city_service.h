// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon without its connections: requests come in, answers go out, from any thread.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <variant>

#include "cli/service/asked_work.h"
#include "cli/service/budget.h"
#include "cli/service/camera_keeper.h"
#include "cli/service/city_routes.h"
#include "cli/service/dense_keeper.h"
#include "cli/service/disk_keeper.h"
#include "cli/service/gatekeeper.h"
#include "cli/service/http_message.h"
#include "cli/service/owner_commands.h"
#include "cli/service/photo_intake.h"
#include "cli/service/quotas.h"
#include "cli/service/removals.h"
#include "cli/service/request_log.h"
#include "cli/service/tus_uploads.h"
#include "cli/service/work_lines.h"
#include "engine/engine.h"

namespace veduta {

// What the daemon takes.
struct ServiceOptions {
  IntakeLimits intake;
  TusOptions tus;
  // Of each token that has no quota of its own. Chosen by hand: more than a person does.
  TokenQuota quota = {100'000, 1ull << 40, 1'000};
  DenseKeeping dense;
  // Threads that take photos and answer what is told soon, and those that compute (WorkKind), 1 to
  // 1024. A localisation takes one for as long as a photo does, and so takes none of the others.
  // Changes, commands and removals have threads of their own.
  uint32_t query_threads = 4, long_threads = 2;
  // Requests that may wait for each kind of them, 1 to 100,000, and those of each one who asks; one
  // more is answered 503, and 429 to the same one. Chosen by hand: a page asks for hundreds of
  // pictures.
  uint32_t waiting_questions_max = 1024, waiting_of_one_max = 256;
  // Every so often steps that have failed are tried again. 1 to 86,400 s.
  uint32_t settle_pause_s = 60;

  Status Check() const;  // the first violated bound, named with its value
};

// Entries of the journal as server-sent events: each with its number as id, so that whoever was cut
// off goes on after the last one that it has.
struct CityEvents {
  std::string text;   // empty: no entry
  uint64_t next = 0;  // the number to go on from
};

// Thread-safe.
class CityService final {
 public:
  // Who hears of what the daemon does by itself, each from a thread of the service's; all may be
  // empty.
  struct Listeners {
    PhotoEnded ended;
    // Of steps that failed and were tried again.
    std::function<void(const FollowUp& step, const Questions& ask)> followed;
    std::function<void(const Status&)> dense_failed;
    // Of damage that an answer was given without: once for each, while there are not too many.
    std::function<void(const std::string&)> damage_met;
    // Of each request that was answered, and each call of RPC that was let in or refused.
    std::function<void(const RequestEntry&)> asked;
  };
  // `path` is the database's.
  CityService(std::unique_ptr<Engine> engine, const std::string& path,
              const ServiceOptions& options, Listeners listeners);
  // Closes, waits for the questions that are at work, and closes the engine: every request is
  // answered then, questions that nobody has begun with by 503.
  ~CityService();
  CityService(const CityService&) = delete;
  CityService& operator=(const CityService&) = delete;

  // Puts photos in line that an earlier daemon has taken and not placed; kCorruption and kIoError
  // where they cannot be read: the others go on.
  Status Resume() { return intake_.Resume(engine_.get()); }

  // Whether requests need tokens: there is one.
  bool asks_for_tokens() const { return gatekeeper_.asks_for_tokens(); }
  bool has_tokens() const { return gatekeeper_.has_tokens(); }

  // The answer to a request that is for nothing, or may not be made, or is one too many: before its
  // body is read. To be asked of each request but a GET that Handle is given, which counts it.
  std::optional<HttpAnswer> Refuse(HttpRequest* request) const;

  // Returns soon. `answered` is called once: by this thread, or by another one later.
  void Handle(HttpRequest request, Answered answered);

  // Whether a request that was let in still is: its token may be revoked, or too old, by now. Notes
  // anew what may be told.
  bool StillAllows(HttpRequest* request) const;
  // What has happened, for one who follows the city. Returns at once; `told` is called once, with
  // an empty text where the journal has no entry from `first` on yet.
  void TellEvents(uint64_t first, const Sight& sight, std::function<void(Result<CityEvents>)> told);

  // Who hears of requests; may be empty.
  const std::function<void(const RequestEntry&)>& told_of_requests() const { return asked_; }
  // Counts, and tells of, a call by RPC that asks for what this request does. `code`: 200, or that
  // of the refusal.
  void NoteCall(const HttpRequest& request, uint32_t code);
  // What other doors than HTTP's ask by. A snapshot of the city, for what a few records tell.
  Questions Ask(const Sight& sight) const { return engine_->Ask(sight); }
  // Runs the task with the engine on one of the threads for such work; where too many wait or the
  // service is closed, the task is told kBusy instead, and kCancelled where its client has gone,
  // then perhaps on this thread. The task must not throw.
  void Run(WorkKind kind, WorkOwner owner,
           std::function<void(Engine* engine, const Status& refusal)> task);
  // PhotoIntake::Accept, within the quotas of the one whom Refuse has found to send it.
  std::variant<uint64_t, HttpAnswer> AcceptPhoto(const HttpRequest& sender, PhotoSubmission photo);
  PhotoIntake* intake() { return &intake_; }
  // PhotoIntake::Find, for one who may see so much.
  HttpAnswer AnswerOnUpload(uint64_t upload, const Sight& sight) const;

  // Takes no photo from now on, has answered those who wait for one's turn when it returns, and is
  // not ready any more. Quick questions are answered as before, others by 503.
  void Close();

 private:
  void TakePhoto(HttpRequest request, const Answered& answered);
  void TakeForm(HttpRequest request, const Answered& answered);
  HttpAnswer Answer(const HttpRequest& request, const RouteMatch& match);
  // What a route does that the engine knows nothing of.
  HttpAnswer AnswerOfItself(const HttpRequest& request);
  HttpAnswer AnswerOnDense(const std::string& asked);
  HttpAnswer Metrics() const;
  Result<CityEvents> EventsFrom(uint64_t first, const Sight& sight) const;
  HttpAnswer AskEngine(const HttpRequest& request, const RouteMatch& match);
  void Count(const HttpAnswer& answer);
  void TellDamages(const HttpAnswer& answer);
  // Whether the route is answered on the thread that asks.
  bool IsQuick(const CityRoute& route) const;
  // Does what Handle has found to take longer, once a thread for it has time.
  void HandleLater(HttpRequest request, const RouteMatch& match, WorkKind kind,
                   const Answered& answered);
  void SettleNowAndThen(std::stop_token stop,
                        const std::function<void(const FollowUp&, const Questions&)>& followed);

  const ServiceOptions options_;
  Gatekeeper gatekeeper_;
  const std::function<void(const std::string&)> damage_met_;
  const std::function<void(const RequestEntry&)> asked_;
  const std::string start_;  // names this run of the daemon, for the tags of its answers
  // Destroyed from the bottom up: nobody asks an engine that is closed, and photos are answered
  // while it closes.
  PhotoIntake intake_;
  mutable Quotas quotas_;
  TusUploads tus_;
  mutable std::mutex mutex_;
  std::map<uint32_t, uint64_t> answers_;                        // how many, by code
  std::set<std::string> damages_;                               // that were told
  std::map<std::pair<std::string, uint32_t>, uint64_t> calls_;  // by RPC, by what and code
  DiskKeeper disk_;  // is told of failures while the engine closes
  std::unique_ptr<Engine> engine_;
  DenseKeeper dense_;
  CameraKeeper cameras_;
  OwnerCommands owner_commands_;
  Removals removals_;
  Budget commands_at_work_;
  std::condition_variable_any pause_;
  std::jthread settler_;
  WorkLines work_;
};

}  // namespace veduta
