// SPDX-License-Identifier: Apache-2.0
#pragma once
// The engine's own thread: it prepares photos ahead on the pool, applies them in turn, and does
// what follows from them when nobody waits.
//
// Which piece is next, in this order:
//   1. one step of what follows, where photos have had more time than such steps, or where a list
//      or Settle waits and a photo was the last piece: so no stream of photos starves what follows
//      from them, and half of the time is theirs, however much follows;
//   2. the first photo of the window that is prepared and may be applied. A photo of a list may be
//      applied when nothing follows from earlier photos any more, other photos at any time (where
//      each photo is to be settled, they wait as those of lists do);
//   3. one step of what follows from photos.
// Every piece takes its turn of the Writer, so that the dense pass and others write in between.
// A long step (DueStep::is_long: a vocabulary, the adjustment of a large reconstruction) is
// computed on a second thread, without a turn, while photos go on. It begins as soon as it is due,
// unless a list or Settle waits: then it begins when its turn among the steps comes, and no other
// step is run before its end, so that where nobody else submits photos it commits what it was
// computed from.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "engine/ingest/ingest.h"
#include "engine/photo/photo_blurrer.h"
#include "engine/photo/photo_preparer.h"
#include "engine/schedule/submission_line.h"
#include "engine/writer/writer.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// The camera that was estimated for a photo, not stored yet (Ingest::Apply), or, where there is
// none, what becomes of the photo.
struct EstimatedUnnamed {
  std::optional<CameraRecord> camera;
  AddOutcome outcome;  // with a camera its times alone
};

// How the camera of a photo is found where none was named.
struct CameraFinder {
  // Looks for a camera that is known already. Ahead of the photo's turn, from any thread.
  std::function<Result<std::optional<CameraRecord>>(const PhotoSource&)> find;
  // Otherwise estimates one, in the photo's turn, by all that was applied before it.
  std::function<Result<EstimatedUnnamed>(const PhotoSource&)> estimate;
};

class Scheduler final {
 public:
  // Computes a long step and commits it in a turn of the writer that it takes for that, and whose
  // length is FollowUp::turn_ms; nothing where it need not be done any more.
  using DoLongStep = std::function<Result<std::optional<FollowUp>>(const DueStep&)>;

  // `ingest` may be exchanged by its owner during a turn of the writer, so it is given by its
  // place. All that is given must outlive the scheduler. `settle_each`: EngineOptions. Without a
  // blurrer photos are stored as they come.
  Scheduler(Writer* writer, const PhotoPreparer* preparer, std::unique_ptr<Ingest>* ingest,
            ThreadPool* pool, CameraFinder cameras, DoLongStep do_long_step,
            bool settle_each = false, std::unique_ptr<PhotoBlurrer> blurrer = nullptr);
  ~Scheduler();

  // Finishes the piece at hand and answers the photos that are not applied by then: kCancelled.
  // Submit and Settle fail with kCancelled from then on. A second call does nothing.
  void Close();

  // Submits one photo that waits on the disk under this number; ticket and lane are still to be
  // given. Where it has no camera, one is sought (CameraFinder).
  Result<Ticket> Submit(uint64_t number, WaitingPhoto photo);
  // Submits a photo of a list into the lane of that list (OpenList).
  Ticket SubmitToList(const std::shared_ptr<Lane>& lane, PhotoSource photo,
                      std::optional<CameraRecord> camera, std::string contributor,
                      std::optional<AwaitedPose> awaited = {});
  std::shared_ptr<Lane> OpenList(std::stop_token stop) { return line_.OpenList(std::move(stop)); }
  // Waits until the photo is answered and what follows from it is done. The list's next photo is
  // not applied before Release: the caller may still stop the list after hearing of this photo.
  static Result<AddOutcome> WaitSettled(const Ticket& ticket, std::vector<FollowUp>* followed);
  void Release(Lane* lane);
  // No further photo of the list is applied. The submitter calls it before it leaves the list.
  void EndList(Lane* lane);

  // Tries what has failed once more, and waits until nothing follows any more. `followed` receives
  // the steps that ran meanwhile, after earlier ones that failed when no caller waited for them.
  // Returns the first failure of those that ran meanwhile.
  Status Settle(std::stop_token stop, std::vector<FollowUp>* followed);

  // How many photos of a list its submitter should keep in line, so that preparation never runs
  // dry. So many photos of lists are prepared ahead, and as many of contributors: each has its own
  // places.
  size_t window() const { return window_; }

 private:
  // A photo taken from the line: being prepared, or ready.
  struct Entry {
    WaitingPhoto photo;
    bool is_started = false;
    bool had_no_camera = false;
    std::optional<Result<PreparedPhoto>> prepared;
  };
  using Entries = std::list<Entry>;
  struct Settling {
    std::stop_token stop;
    std::vector<FollowUp>* followed;
    bool is_done = false;
  };

  void Run();
  // One piece of work; false when there is none. `lock` is held, and given up while working.
  bool DoPiece(std::unique_lock<std::mutex>* lock);
  // Moves photos from the line into the window and offers their preparation to the pool.
  void FillWindow(std::unique_lock<std::mutex>* lock);
  // Prepares a photo that nobody has begun with; false when there is none.
  bool PrepareOne(std::unique_lock<std::mutex>* lock, bool also_of_lists = true);
  // The first that is ready and may be applied; end() when there is none.
  Entries::iterator FindApplicable();
  // Applies the photo in its turn. Like DoStep, it always returns true: a piece was done.
  bool Apply(Entries::iterator entry, std::unique_lock<std::mutex>* lock);
  // Has the photo blurred, unless it is, and prepares it with its camera. Ahead of its turn, one
  // without a camera that is known fails with kNotFound.
  Result<PreparedPhoto> Prepare(WaitingPhoto* photo, PhotoPreparer::Company company) const;
  // A photo that cannot be judged is an outcome with a failure.
  Result<AddOutcome> ApplyInTurn(Entry* entry);
  // Finds or estimates the camera of a photo that has none. Nothing where it has one then;
  // otherwise what becomes of it.
  Result<std::optional<AddOutcome>> SeekCamera(Entry* entry, StepTimes* times);
  Result<AddOutcome> PrepareAndApply(Entry* entry);
  Result<AddOutcome> ApplyPrepared(Entry* entry);  // takes the turn
  bool DoStep(std::unique_lock<std::mutex>* lock);
  // Whether a list or a caller of Settle waits for what follows.
  bool DoesSomebodySettle() const;
  void StartLongStep(const DueStep& step);  // with the lock held
  void WorkLong(const DueStep& step);       // on the second thread
  // Reports a finished step to the photo of a list and the callers of Settle that wait for it; a
  // failure that nobody waits for goes to the next caller of Settle. With the lock held.
  void Tell(FollowUp step);
  // Answers photos that were cancelled, or whose list has ended, without applying them.
  void DropCancelled(std::unique_lock<std::mutex>* lock);
  // Takes a waiting photo up; false when it was cancelled.
  static bool TakeUp(PhotoProgress* ticket);
  static void Answer(const WaitingPhoto& photo, Result<AddOutcome> answer, bool settles_later);
  void MarkSettled();
  void NotifyChanged();  // with the lock held
  void FinishSettling();

  Writer* const writer_;
  const PhotoPreparer* const preparer_;
  std::unique_ptr<Ingest>* const ingest_;
  ThreadPool* const pool_;
  const CameraFinder cameras_;
  const DoLongStep do_long_step_;
  const std::unique_ptr<PhotoBlurrer> blurrer_;  // may be null
  const size_t window_;

  std::mutex mutex_;
  std::condition_variable changed_;
  SubmissionLine line_;
  Entries entries_;
  size_t preparing_ = 0;                           // tasks of the pool that are not done
  std::shared_ptr<PhotoProgress> settling_photo_;  // applied; what follows is not done yet
  bool does_list_settle_ = false;                  // it is of a list, whose submitter waits for it
  std::list<Settling*> settling_;                  // callers of Settle
  bool tries_failed_again_ = false;                // one of them has come since the last step
  std::vector<FollowUp> untold_;                   // steps that failed when nobody was to be told
  bool may_follow_ = false;  // somebody has submitted or settled: what is due is done from then on
  bool follows_ = true;      // there may be a step; false once there was none, until the next photo
  std::optional<DueStep> at_work_;  // the long step that the second thread computes
  bool was_photo_last_ = false;
  // The time that photos have had while steps were due, less that of steps.
  double steps_owed_ms_ = 0;
  bool stopping_ = false;
  uint64_t changes_ = 0;  // counts what the scheduler's thread may have missed while it worked
  std::thread long_worker_;
  std::thread thread_;
};

}  // namespace veduta
