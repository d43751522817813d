// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon without its connections: requests come in, answers go out, from any thread.

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "cli/service/city_routes.h"
#include "cli/service/http_message.h"
#include "cli/service/photo_intake.h"
#include "engine/engine.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// What the daemon takes.
struct ServiceOptions {
  // Photos that may wait for their turn, 1 to 100,000. Chosen by hand: some minutes of work.
  uint32_t waiting_photos_max = 256;
  // Threads that answer questions, 1 to 1024. A localisation takes one for as long as a photo does,
  // so there are some for those who ask less.
  uint32_t query_threads = 4;

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
  // `ended` hears of each photo.
  CityService(std::unique_ptr<Engine> engine, const ServiceOptions& options, PhotoEnded ended = {});
  // Closes, waits for the questions that are at work, and closes the engine: every request is
  // answered then.
  ~CityService();
  CityService(const CityService&) = delete;
  CityService& operator=(const CityService&) = delete;

  // Returns soon. `answered` is called once: by this thread, or by another one later.
  void Handle(HttpRequest request, Answered answered);

  // What has happened, for one who follows the city. Returns at once; `told` is called once, with
  // an   // empty text where the journal has no entry from `first` on yet.
  void TellEvents(uint64_t first, std::function<void(Result<CityEvents>)> told);

  // Takes no photo from now on, answers those that wait for their turn, and is not ready any more.
  // Questions are answered as before.
  void Close();

 private:
  HttpAnswer Answer(const HttpRequest& request, const RouteMatch& match) const;
  // What a route does that the engine knows nothing of.
  HttpAnswer AnswerOfItself(const HttpRequest& request) const;
  HttpAnswer Metrics() const;
  Result<CityEvents> EventsFrom(uint64_t first) const;
  HttpAnswer AskEngine(const HttpRequest& request, const RouteMatch& match) const;
  void Count(const HttpAnswer& answer);
  // After a failed write the engine refuses all others until its files are opened again: that is
  // done once and again, as long as photos fail.
  void ReopenAfter(const Status& failure);

  const std::string start_;  // names this run of the daemon, for the tags of its answers
  // Destroyed from the bottom up: nobody asks an engine that is closed, and photos are answered
  // while it closes.
  PhotoIntake intake_;
  mutable std::mutex mutex_;
  std::map<uint32_t, uint64_t> answers_;  // how many, by code
  bool is_closed_ = false;
  std::optional<std::chrono::steady_clock::time_point> reopened_;  // the last time
  std::unique_ptr<Engine> engine_;
  ThreadPool pool_;
};

}  // namespace veduta
