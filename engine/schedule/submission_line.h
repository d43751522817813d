// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that wait for their turn, in lanes: one lane per contributor, and one per list of photos.
// Lanes take turns, one photo each; within a lane the order of submission stays.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/door/submission.h"
#include "engine/photo/photo_preparer.h"
#include "storage/model/camera.h"

namespace veduta {

// What is known of a photo from its submission to its answer. Waiting, then either taken up to be
// applied or cancelled, then answered; and settled when what follows from it is done, too.
struct PhotoProgress {
  enum class Phase : uint8_t { kWaiting, kTaken, kAnswered };

  explicit PhotoProgress(uint64_t n) : number(n) {}
  const uint64_t number;
  std::mutex mutex;
  std::condition_variable changed;
  Phase phase = PhotoProgress::Phase::kWaiting;
  Result<AddOutcome> answer = Status::Cancelled("not answered yet");
  bool is_settled = false;
  std::vector<FollowUp> followed;  // of a photo of a list: the steps that followed from it
};

// The photos of one submitter.
struct Lane {
  std::string name;  // the contributor; empty for a list
  bool is_list = false;
  bool settles = false;  // what follows from a photo is done before the next is applied
  std::stop_token stop;  // of a list: no further photo is applied after a request
  // Of a list, guarded by the scheduler: no further photo is applied after an error, nor once
  // AddPhotos has been left, nor before the last photo's report has returned.
  bool has_ended = false;
  bool is_held = false;
};

// Whether a photo that waits on the disk is to wait on after this failure, which says nothing about
// it: the engine is being closed, the disk has failed, the memory is short, or its camera cannot be
// told yet.
bool WaitsOn(const Status& failure);
// The failure of one whose camera is not named and cannot be told yet.
inline constexpr StatusCode kCameraUnknown = StatusCode::kNotFound;

struct WaitingPhoto {
  std::shared_ptr<PhotoProgress> ticket;
  std::shared_ptr<Lane> lane;
  PhotoSource photo;
  std::optional<CameraRecord> camera;  // nothing where none was named and it is not known yet
  std::string contributor;
  uint32_t contribution = 0;  // that it comes with; 0: with none
  std::optional<AwaitedPose> awaited = {};
  // Where photos are blurred: whether `photo` is what is to be stored; why it is not; and what
  // came, where areas of it were filled.
  bool is_blurred = false;
  Status blur_failure = {};
  std::shared_ptr<const std::vector<uint8_t>> original = {};
  AnswerCallback answered;
  // Of a photo that waits on the disk: called before it is answered, without any lock held. The
  // first argument says whether it has no need to wait any more.
  std::function<void(bool has_ended, const Result<AddOutcome>& answer)> leave;
};

// Tells of a photo whose ticket was cancelled, and which knows the answer.
void AnswerCancelled(const WaitingPhoto& photo);

// Thread-safe.
class SubmissionLine final {
 public:
  // `settles`: the lanes of contributors settle; those of lists always do.
  explicit SubmissionLine(bool settles = false) : settles_(settles) {}

  // A lane of its own for a list.
  std::shared_ptr<Lane> OpenList(std::stop_token stop);
  // Of a list's photo.
  Ticket Join(std::shared_ptr<Lane> lane, PhotoSource photo, std::optional<CameraRecord> camera,
              std::string contributor, std::optional<AwaitedPose> awaited = {});
  // Of one that waits on the disk, under this number: joins the lane of its contributor.
  Ticket Join(uint64_t number, WaitingPhoto photo);
  // The next photo by turns; false when nobody waits. Passes over the photos of lists, or those of
  // contributors, where they are not wanted.
  bool Take(WaitingPhoto* photo, bool of_lists = true, bool of_contributors = true);
  bool is_empty() const;

  // The ticket of a photo that has had its turn.
  static Ticket Answered(uint64_t number, AddOutcome outcome);
  // A handle of the photo's state, for the scheduler.
  static const std::shared_ptr<PhotoProgress>& ProgressOf(const Ticket& ticket);

 private:
  struct Queue {
    std::shared_ptr<Lane> lane;
    std::deque<WaitingPhoto> photos;
  };

  Ticket Join(std::list<Queue>::iterator queue, uint64_t number, WaitingPhoto photo);

  const bool settles_;
  mutable std::mutex mutex_;
  uint64_t next_number_ = 1;  // of photos of lists
  std::list<Queue> queues_;   // whose turn is next stands first; none is empty
};

}  // namespace veduta
