// SPDX-License-Identifier: Apache-2.0
#include "engine/schedule/scheduler.h"

#include <algorithm>
#include <utility>

#include "storage/base/memory_shortage.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Whether the photos keep their order. A contributor's lane is made anew whenever the line has run
// out of photos, so its name counts.
bool IsSameLane(const Lane& a, const Lane& b) {
  return &a == &b || (!a.is_list && !b.is_list && a.name == b.name);
}

}  // namespace

Scheduler::Scheduler(Writer* writer, const PhotoPreparer* preparer, std::unique_ptr<Ingest>* ingest,
                     ThreadPool* pool, CameraFinder cameras, DoLongStep do_long_step,
                     bool settle_each, std::unique_ptr<PhotoBlurrer> blurrer)
    : writer_(writer),
      preparer_(preparer),
      ingest_(ingest),
      pool_(pool),
      cameras_(std::move(cameras)),
      do_long_step_(std::move(do_long_step)),
      blurrer_(std::move(blurrer)),
      window_(2 * pool->thread_count() + 1),
      line_(settle_each),
      thread_([this] { Run(); }) {}

Scheduler::~Scheduler() {
  Close();
}

void Scheduler::Close() {
  std::unique_lock lock(mutex_);
  stopping_ = true;
  if (blurrer_ != nullptr) blurrer_->Stop();
  NotifyChanged();
  lock.unlock();
  if (thread_.joinable()) thread_.join();
  if (long_worker_.joinable()) long_worker_.join();
  lock.lock();
  changed_.wait(lock, [&] { return preparing_ == 0; });
  for (WaitingPhoto photo; line_.Take(&photo);)
    entries_.push_back({std::move(photo), true, false, {}});
  const Entries left = std::move(entries_);
  entries_.clear();
  lock.unlock();
  for (const Entry& entry : left) {
    const WaitingPhoto& photo = entry.photo;
    if (TakeUp(photo.ticket.get())) {
      Answer(photo, Status::Cancelled("the engine was closed before the photo's turn came"), false);
    } else {  // cancelled, and not told yet
      AnswerCancelled(photo);
    }
  }
  MarkSettled();
}

Result<Ticket> Scheduler::Submit(uint64_t number, WaitingPhoto photo) {
  const std::lock_guard lock(mutex_);
  if (stopping_) return Status::Cancelled("the engine is being closed: it takes no photo any more");
  may_follow_ = true;
  Ticket ticket = line_.Join(number, std::move(photo));
  NotifyChanged();
  return ticket;
}

Ticket Scheduler::SubmitToList(const std::shared_ptr<Lane>& lane, PhotoSource photo,
                               std::optional<CameraRecord> camera, std::string contributor,
                               std::optional<AwaitedPose> awaited) {
  const std::lock_guard lock(mutex_);
  may_follow_ = true;
  Ticket ticket = line_.Join(lane, std::move(photo), std::move(camera), std::move(contributor),
                             std::move(awaited));
  if (stopping_) ticket.Cancel();  // nobody takes it out of the line any more
  NotifyChanged();
  return ticket;
}

Result<AddOutcome> Scheduler::WaitSettled(const Ticket& ticket, std::vector<FollowUp>* followed) {
  const std::shared_ptr<PhotoProgress>& state = SubmissionLine::ProgressOf(ticket);
  std::unique_lock lock(state->mutex);
  state->changed.wait(
      lock, [&] { return state->phase == PhotoProgress::Phase::kAnswered && state->is_settled; });
  *followed = std::move(state->followed);
  return state->answer;
}

void Scheduler::Release(Lane* lane) {
  const std::lock_guard lock(mutex_);
  lane->is_held = false;
  NotifyChanged();
}

void Scheduler::EndList(Lane* lane) {
  const std::lock_guard lock(mutex_);
  lane->has_ended = true;
  NotifyChanged();
}

Status Scheduler::Settle(std::stop_token stop, std::vector<FollowUp>* followed) {
  Settling settling{std::move(stop), followed, false};
  const std::stop_callback wake(settling.stop, [this] {
    const std::lock_guard lock(mutex_);
    NotifyChanged();
  });
  std::unique_lock lock(mutex_);
  may_follow_ = true;
  follows_ = true;  // somebody has to look, and to say that nothing follows
  tries_failed_again_ = true;
  followed->insert(followed->end(), untold_.begin(), untold_.end());
  const size_t told_before = followed->size();
  untold_.clear();
  settling_.push_back(&settling);
  NotifyChanged();
  changed_.wait(lock,
                [&] { return settling.is_done || stopping_ || settling.stop.stop_requested(); });
  settling_.remove(&settling);
  if (!settling.is_done) return Status::Cancelled("stopped before everything was settled");
  for (size_t i = told_before; i < followed->size(); ++i)
    VEDUTA_RETURN_IF_ERROR((*followed)[i].status);
  return Status::Ok();
}

void Scheduler::Run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const uint64_t seen = changes_;
    if (DoPiece(&lock)) continue;
    changed_.wait(lock, [&] { return changes_ != seen; });
  }
}

void Scheduler::NotifyChanged() {
  ++changes_;
  changed_.notify_all();
}

bool Scheduler::DoPiece(std::unique_lock<std::mutex>* lock) {
  FillWindow(lock);
  DropCancelled(lock);
  const bool may_step = may_follow_ && follows_;
  // Lists and Settle wait until nothing follows any more: for them every other piece is a step.
  if (may_step && (steps_owed_ms_ > 0 || (was_photo_last_ && DoesSomebodySettle())))
    return DoStep(lock);
  if (const auto entry = FindApplicable(); entry != entries_.end()) return Apply(entry, lock);
  // A step runs now if it delays no answer: no photo waits, or only those that wait for it.
  const bool all_settle = std::all_of(entries_.begin(), entries_.end(),
                                      [](const Entry& e) { return e.photo.lane->settles; });
  if (may_step && all_settle) return DoStep(lock);
  // While a photo is ready, this thread prepares no photo of a list, so that the ready one is
  // applied as soon as its list goes on. The caller that was told of the last photo of the list may
  // wait for a photo of a contributor.
  const bool is_one_ready = std::any_of(entries_.begin(), entries_.end(),
                                        [](const Entry& e) { return e.prepared.has_value(); });
  return PrepareOne(lock, !is_one_ready);
}

void Scheduler::FillWindow(std::unique_lock<std::mutex>* lock) {
  size_t offered = 0;
  for (WaitingPhoto photo;;) {
    const auto of_lists = static_cast<size_t>(std::count_if(
        entries_.begin(), entries_.end(), [](const Entry& e) { return e.photo.lane->is_list; }));
    if (!line_.Take(&photo, of_lists < window_, entries_.size() - of_lists < window_)) break;
    const bool had_no_camera = !photo.camera;
    entries_.push_back({std::move(photo), false, had_no_camera, {}});
    ++offered;
  }
  if (pool_->thread_count() == 0) return;
  preparing_ += offered;
  lock->unlock();
  for (; offered > 0; --offered) {
    pool_->Submit([this] {
      std::unique_lock task_lock(mutex_);
      if (!stopping_) PrepareOne(&task_lock);
      --preparing_;
      NotifyChanged();
    });
  }
  lock->lock();
}

bool Scheduler::PrepareOne(std::unique_lock<std::mutex>* lock, bool also_of_lists) {
  const auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return !e.is_started && (also_of_lists || !e.photo.lane->is_list);
  });
  if (entry == entries_.end()) return false;
  entry->is_started = true;
  lock->unlock();
  Result<PreparedPhoto> prepared = Prepare(&entry->photo, PhotoPreparer::Company::kOthers);
  lock->lock();
  entry->prepared = std::move(prepared);
  NotifyChanged();
  return true;
}

Scheduler::Entries::iterator Scheduler::FindApplicable() {
  const bool list_may = !settling_photo_ && !follows_ && !at_work_;
  return std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    // Within a lane the order stays, so a list waits for its first photo.
    const bool is_first = std::none_of(entries_.begin(), entries_.end(), [&](const Entry& other) {
      return IsSameLane(*other.photo.lane, *e.photo.lane) &&
             other.photo.ticket->number < e.photo.ticket->number;
    });
    return is_first && e.prepared &&
           (!e.photo.lane->settles || (list_may && !e.photo.lane->is_held));
  });
}

bool Scheduler::TakeUp(PhotoProgress* ticket) {
  const std::lock_guard lock(ticket->mutex);
  if (ticket->phase != PhotoProgress::Phase::kWaiting) return false;
  ticket->phase = PhotoProgress::Phase::kTaken;
  return true;
}

void Scheduler::Answer(const WaitingPhoto& photo, Result<AddOutcome> answer, bool settles_later) {
  if (photo.leave) photo.leave(answer.ok() || !WaitsOn(answer.status()), answer);
  PhotoProgress& ticket = *photo.ticket;
  {
    const std::lock_guard lock(ticket.mutex);
    ticket.answer = std::move(answer);
    ticket.phase = PhotoProgress::Phase::kAnswered;
    ticket.is_settled = !settles_later;
  }
  ticket.changed.notify_all();
  if (photo.answered) photo.answered(ticket.answer);
}

void Scheduler::DropCancelled(std::unique_lock<std::mutex>* lock) {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool is_busy = entry->is_started && !entry->prepared;
    const Lane& lane = *entry->photo.lane;
    const bool has_ended = lane.has_ended || lane.stop.stop_requested();
    bool was_cancelled = false;
    {
      const std::lock_guard ticket_lock(entry->photo.ticket->mutex);
      was_cancelled = entry->photo.ticket->phase == PhotoProgress::Phase::kAnswered;
    }
    if (is_busy || (!has_ended && !was_cancelled)) {
      ++entry;
      continue;
    }
    Entry dropped = std::move(*entry);
    entry = entries_.erase(entry);
    lock->unlock();
    dropped.prepared.reset();  // which gives up what was written ahead
    if (was_cancelled) {
      AnswerCancelled(dropped.photo);
    } else if (TakeUp(dropped.photo.ticket.get())) {
      Answer(dropped.photo, Status::Cancelled("its list ended before the photo's turn came"),
             false);
    }
    lock->lock();
    entry = entries_.begin();  // the list may have changed meanwhile
  }
}

bool Scheduler::DoesSomebodySettle() const {
  return settling_photo_ || !settling_.empty() ||
         std::ranges::any_of(entries_, [](const Entry& e) { return e.photo.lane->settles; });
}

bool Scheduler::Apply(Entries::iterator entry, std::unique_lock<std::mutex>* lock) {
  Entry taken = std::move(*entry);
  entries_.erase(entry);
  const bool is_of_list = taken.photo.lane->is_list;
  lock->unlock();
  if (!TakeUp(taken.photo.ticket.get())) {  // cancelled at this moment: DropCancelled answers it
    lock->lock();
    entries_.push_front(std::move(taken));
    return true;
  }
  Stopwatch watch;
  Result<AddOutcome> outcome = ApplyInTurn(&taken);
  const double ms = watch.LapMs();
  // The sender of a single photo learns of a failure as an error; a list goes on.
  if (!is_of_list && outcome.ok() && !outcome->failure.ok()) outcome = Status(outcome->failure);
  const bool failed = !outcome.ok();
  lock->lock();
  was_photo_last_ = true;
  // Where steps must wait for a long one, they are owed nothing.
  if (!at_work_ || !DoesSomebodySettle()) steps_owed_ms_ += ms;
  follows_ = true;
  if (is_of_list && failed) taken.photo.lane->has_ended = true;
  const bool settles_later = taken.photo.lane->settles && !failed;
  if (settles_later) {
    settling_photo_ = taken.photo.ticket;
    does_list_settle_ = is_of_list;
    taken.photo.lane->is_held = is_of_list;
  }
  lock->unlock();
  Answer(taken.photo, std::move(outcome), settles_later);
  lock->lock();
  return true;
}

bool Scheduler::DoStep(std::unique_lock<std::mutex>* lock) {
  was_photo_last_ = false;
  const bool somebody_settles = DoesSomebodySettle();
  LongSteps long_steps{at_work_, !somebody_settles, {}};
  if (at_work_ && somebody_settles) {
    follows_ = false;  // the end of the long step makes this function look again
    return true;
  }
  const bool tries_failed_again = std::exchange(tries_failed_again_, false);
  lock->unlock();
  Stopwatch watch;
  std::optional<FollowUp> step;
  {
    Writer::Turn turn = writer_->Take();
    watch.LapMs();  // the wait for the turn is not the step's
    if (tries_failed_again) (*ingest_)->TryFailedAgain();
    step = (*ingest_)->RunNextStep(&long_steps);
  }
  const double ms = watch.LapMs();
  lock->lock();
  // Many steps while no photo came are no reason for many photos without one.
  steps_owed_ms_ = std::max(steps_owed_ms_ - ms, -ms);
  if (long_steps.next && !stopping_) StartLongStep(*long_steps.next);
  if (step) {
    step->ms = step->turn_ms = ms;
    Tell(*std::move(step));
  }
  if (step || long_steps.next) return true;
  if (long_steps.at_work && !at_work_) return true;  // it has ended meanwhile: look again
  if (tries_failed_again_) return true;              // Settle has come meanwhile
  follows_ = false;
  steps_owed_ms_ = 0;
  if (at_work_) return true;  // its end makes this function look again
  MarkSettled();
  FinishSettling();
  return true;
}

void Scheduler::StartLongStep(const DueStep& step) {
  if (long_worker_.joinable()) long_worker_.join();  // it has let go of the lock, and ends
  at_work_ = step;
  long_worker_ = std::thread([this, step] { WorkLong(step); });
}

void Scheduler::WorkLong(const DueStep& step) {
  Stopwatch watch;
  const bool is_training = step.kind == FollowUpKind::kVocabulary;
  Result<std::optional<FollowUp>> done =
      CatchShortage(is_training ? "train the vocabulary" : "adjust a large reconstruction",
                    [&] { return do_long_step_(step); });
  FollowUp failed;
  failed.kind = step.kind;
  failed.reconstruction = step.reconstruction;
  failed.status = done.status();
  if (!done.ok()) done = std::optional(std::move(failed));
  if (*done && !(*done)->status.ok()) {
    Writer::Turn turn = writer_->Take();
    (*ingest_)->SetAside(step);
  }
  const std::lock_guard lock(mutex_);
  if (*done) {
    (*done)->ms = watch.LapMs();
    Tell(**std::move(done));
  }
  at_work_.reset();
  follows_ = true;
  NotifyChanged();
}

void Scheduler::Tell(FollowUp step) {
  if (settling_photo_) {
    const std::lock_guard ticket_lock(settling_photo_->mutex);
    if (settling_photo_->answer.ok()) {
      StepTimes& times = settling_photo_->answer->times;
      times.follow_ms += step.ms;
      times.total_ms += step.ms;
      times.longest_step_ms = std::max(times.longest_step_ms, step.turn_ms);
    }
    if (does_list_settle_) settling_photo_->followed.push_back(step);
  }
  for (Settling* settling : settling_) settling->followed->push_back(step);
  const bool is_told = (settling_photo_ && does_list_settle_) || !settling_.empty();
  if (!is_told && !step.status.ok()) untold_.push_back(std::move(step));
}

void Scheduler::MarkSettled() {
  if (!settling_photo_) return;
  {
    const std::lock_guard lock(settling_photo_->mutex);
    settling_photo_->is_settled = true;
  }
  settling_photo_->changed.notify_all();
  settling_photo_.reset();
}

void Scheduler::FinishSettling() {
  if (settling_.empty()) return;
  for (Settling* settling : settling_) settling->is_done = true;
  NotifyChanged();
}

}  // namespace veduta
