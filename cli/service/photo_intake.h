// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that people send to the daemon. Each is put on the disk, waits there for its turn, however
// often the daemon ends meanwhile, and is told what became of it.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// Called once, from any thread. It must not throw, and should be quick.
using Answered = std::function<void(HttpAnswer)>;

// Hears what became of each photo, before its sender does; to be as AnswerCallback.
using PhotoEnded = std::function<void(uint64_t upload, const std::string& name,
                                      const Result<AddOutcome>& outcome)>;

// What is known of an upload.
struct UploadNews {
  uint64_t number = 0;
  std::string name, contributor;
  // Its turn has come, and this is what became of it; a failure where it could not be judged.
  std::optional<Result<AddOutcome>> ended;
  std::string why_not;  // why its turn has failed, or has not come
  // It waits since its camera is not named and cannot be told yet: it is tried again as the city
  // grows.
  bool awaits_camera = false;

  Json ToJson() const;
};

// Called once, from any thread. It must not throw, and should be quick.
using UploadHeard = std::function<void(const UploadNews&)>;

// What may wait for its turn, in all. Chosen by hand: an hour or so of work.
struct IntakeLimits {
  uint32_t photos_max = 10'000;      // 1 to 1,000,000
  uint64_t bytes_max = 16ull << 30;  // at least 1

  Status Check() const;  // the first violated bound, named with its value
};

// Thread-safe. Must outlive the engine: photos are answered until the engine is closed.
class PhotoIntake final {
 public:
  // The second half of the places is for contributors of whom no photo waits, so that nobody holds
  // up all others.
  PhotoIntake(const IntakeLimits& limits, PhotoEnded ended)
      : limits_(limits), ended_(std::move(ended)) {}

  // Puts the photo that the request carries on the disk and in line, which takes as long as writing
  // it does. Answers 202 at once to a sender who does not want to wait, with the number of the
  // upload; otherwise, once the photo has had its turn, 201 with its verdict, 409 for a photo that
  // is there already and 422 for one that is of no use, both with the outcome. 202 as well where
  // the turn has not come yet and the daemon closes, or the disk fails. 429 where the line is full,
  // and 503 where the disk refuses, with a time after which to come again.
  void Take(Engine* engine, HttpRequest request, Answered answered);
  // The answer where no photo of so many bytes would get a place now: 429, or 503 while it closes.
  std::optional<HttpAnswer> RefuseFull(const std::string& contributor, uint64_t size_bytes) const;
  // Engine::ContinueUpload. The photo had to find a place when it was announced (RefuseFull), so
  // the last of its bytes are taken however many wait by then.
  Result<PartialUploadAnswer> Continue(Engine* engine, const std::string& id, uint64_t offset,
                                       std::span<const uint8_t> bytes);
  // Puts a photo on the disk and in line: its number, or the answer where nothing is stored.
  std::variant<uint64_t, HttpAnswer> Accept(Engine* engine, PhotoSubmission photo);
  // Tells what becomes of an upload, once: when it has had its turn, or where the turn cannot come
  // now, since the daemon closes or the disk fails. 404 where nothing is known of it: `heard` is
  // not called then.
  // Who waits no longer lets go of what `waiting` refers to, where that is given.
  std::optional<HttpAnswer> Await(uint64_t upload, UploadHeard heard,
                                  std::optional<std::weak_ptr<const void>> waiting = {});
  // Puts the photos in line that wait on the disk and are not in line: an earlier daemon has left
  // them, the disk failed when their turn came, or their camera could not be told and, unless all
  // of those are to be tried, 2^n photos were stored since the n-th try. Forgets those that are
  // gone from the disk. The first failure; it keeps none of the others back.
  Status Resume(Engine* engine, bool with_all_cameraless = false);
  // Waits until at least so many photos wait for their cameras, and either they are 1,500, or
  // nothing has come and no other photo has waited for its turn for so long. How many they are; 0
  // after a stop request.
  size_t AwaitCameraless(size_t count_min, std::chrono::seconds quiet, const std::stop_token& stop);
  // What is known of an upload: one that waits, or of the last ones that have had their turn. 404
  // for any other.
  HttpAnswer Find(uint64_t upload) const;
  std::optional<UploadNews> News(uint64_t upload) const;  // nothing where it is 404

  // Takes no photo from now on, and has answered those who wait, 202, when it returns.
  void Close();
  bool is_closing() const;

  struct Counts {
    uint64_t waiting = 0, waiting_bytes = 0;  // for their turn, or being applied
    uint64_t awaiting_camera = 0;             // of `waiting`
    std::map<std::string, uint64_t> ended;    // by OutcomeWord
    double seconds = 0;                       // that these have taken, by AddOutcome::times
  };
  Counts counts() const;

 private:
  // One photo, from its place in line on.
  struct Upload;
  // A place in line, or the answer where there is none.
  std::optional<HttpAnswer> TakePlace(const Upload& upload);
  // These seven with the lock held. NoteEnded forgets the oldest of too many that have ended.
  std::optional<HttpAnswer> CheckPlace(const std::string& contributor, uint64_t size_bytes) const;
  void AddPlace(const Upload& upload);
  void GivePlace(const Upload& upload);
  void NoteEnded(uint64_t number);
  void SetInLine(Upload* upload, bool is_in_line);
  void PutOff(Upload* upload, const Status& why);
  void EndUpload(Upload* upload, const Result<AddOutcome>& outcome);
  // Enters the photo under its number, once that is known.
  void Enter(uint64_t number, const std::shared_ptr<Upload>& upload);
  static HttpAnswer UnknownUpload(uint64_t upload);
  // Those that are known, have not ended and are not in line.
  std::vector<uint64_t> ListPutOff() const;
  // Ends those of them that do not wait on the disk any more; `on_disk` is ascending.
  void ForgetGone(const std::vector<uint64_t>& put_off, const std::vector<UploadAnswer>& on_disk);
  Status ResumeOne(Engine* engine, const UploadAnswer& one, bool with_all_cameraless);
  // What the engine answers.
  void End(const std::shared_ptr<Upload>& upload, const Result<AddOutcome>& outcome);

  const IntakeLimits limits_;
  const PhotoEnded ended_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;  // a photo has come, or had its turn
  bool is_closing_ = false;
  Counts counts_;
  size_t put_off_ = 0;   // of those that have a place
  uint64_t stored_ = 0;  // photos that were, of all that came
  std::chrono::steady_clock::time_point last_change_;
  std::map<std::string, size_t> places_;                 // that a contributor has; no zeros
  std::map<uint64_t, std::shared_ptr<Upload>> uploads_;  // by their numbers
  std::set<uint64_t> ended_uploads_;                     // of them
};

}  // namespace veduta
