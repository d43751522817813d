// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that people send to the daemon: at most so many wait for their turn, each is answered by
// what became of it, and those that still wait when the daemon closes are told to come again.

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// Called once, from any thread. It must not throw, and should be quick.
using Answered = std::function<void(HttpAnswer)>;

// Hears what became of each photo, before its sender does; to be as AnswerCallback.
using PhotoEnded = std::function<void(const std::string& name, const Result<AddOutcome>& outcome)>;

// Thread-safe. Must outlive the engine: photos are answered until the engine is closed.
class PhotoIntake final {
 public:
  // `waiting_max`: photos that may wait for their turn; one more is answered 429. The second half
  // of the places is for contributors of whom no photo waits, so that nobody holds up all others.
  PhotoIntake(size_t waiting_max, PhotoEnded ended)
      : waiting_max_(waiting_max), ended_(std::move(ended)) {}

  // Puts the photo that the request carries in line. Answers 201 once it is stored, with its
  // verdict; 409 for a photo that is there already and 422 for one that is of no use, both with the
  // outcome; 429 where the line is full and 503 where the disk refuses, with a time after which to
  // come again.
  void Take(Engine* engine, HttpRequest request, Answered answered);

  // Takes no photo from now on, and has answered those that wait, 503, when it returns. The one at
  // hand is finished.
  void Close();
  bool is_closing() const;

  struct Counts {
    uint64_t waiting = 0;                   // for their turn, or being applied
    std::map<std::string, uint64_t> ended;  // by OutcomeWord
    double seconds = 0;                     // that these have taken, by AddOutcome::times
  };
  Counts counts() const;

 private:
  struct Arrival;
  struct Waiting {
    Ticket ticket;
    std::shared_ptr<Arrival> arrival;
  };
  // A place in line, or the answer where there is none.
  std::optional<HttpAnswer> TakePlace(const std::string& contributor);
  void Submit(Engine* engine, HttpRequest request, const std::shared_ptr<Arrival>& arrival);
  // Answers, once, and frees the place.
  void End(Arrival* arrival, const Result<AddOutcome>& outcome);

  const size_t waiting_max_;
  const PhotoEnded ended_;
  mutable std::mutex mutex_;
  bool is_closing_ = false;
  Counts counts_;
  std::map<std::string, size_t> places_;  // that a contributor has; no zeros
  std::map<uint64_t, Waiting> waiting_;   // by the numbers of their tickets
};

}  // namespace veduta
