// SPDX-License-Identifier: Apache-2.0
#include "engine/schedule/submission_line.h"

#include <algorithm>
#include <utility>

namespace veduta {

uint64_t Ticket::number() const {
  return progress_ ? progress_->number : 0;
}

bool Ticket::IsDone() const {
  if (!progress_) return false;
  const std::lock_guard lock(progress_->mutex);
  return progress_->phase == PhotoProgress::Phase::kAnswered;
}

Result<AddOutcome> Ticket::Wait() const {
  if (!progress_) return Status::InvalidArgument("a ticket of no submission has no answer");
  std::unique_lock lock(progress_->mutex);
  progress_->changed.wait(lock,
                          [&] { return progress_->phase == PhotoProgress::Phase::kAnswered; });
  return progress_->answer;
}

bool Ticket::Cancel() {
  if (!progress_) return false;
  {
    const std::lock_guard lock(progress_->mutex);
    if (progress_->phase != PhotoProgress::Phase::kWaiting) return false;
    progress_->phase = PhotoProgress::Phase::kAnswered;
    progress_->is_settled = true;
    progress_->answer = Status::Cancelled("cancelled before its turn came; nothing was stored");
  }
  progress_->changed.notify_all();
  return true;
}

bool WaitsOn(const Status& failure) {
  const StatusCode code = failure.code();
  return code == StatusCode::kCancelled || code == StatusCode::kNoMemory ||
         code == StatusCode::kIoError || code == StatusCode::kBusy || code == kCameraUnknown;
}

void AnswerCancelled(const WaitingPhoto& photo) {
  if (photo.leave) photo.leave(true, photo.ticket->answer);
  if (photo.answered) photo.answered(photo.ticket->answer);
}

std::shared_ptr<Lane> SubmissionLine::OpenList(std::stop_token stop) {
  auto lane = std::make_shared<Lane>();
  lane->is_list = lane->settles = true;
  lane->stop = std::move(stop);
  return lane;
}

Ticket SubmissionLine::Join(std::shared_ptr<Lane> lane, PhotoSource photo,
                            std::optional<CameraRecord> camera, std::string contributor,
                            std::optional<AwaitedPose> awaited) {
  const std::lock_guard lock(mutex_);
  auto queue = std::ranges::find(queues_, lane, &Queue::lane);
  if (queue == queues_.end()) queue = queues_.insert(queues_.end(), Queue{std::move(lane), {}});
  WaitingPhoto waiting;
  waiting.photo = std::move(photo);
  waiting.camera = std::move(camera);
  waiting.contributor = std::move(contributor);
  waiting.awaited = std::move(awaited);
  return Join(queue, next_number_++, std::move(waiting));
}

Ticket SubmissionLine::Join(uint64_t number, WaitingPhoto photo) {
  const std::lock_guard lock(mutex_);
  auto queue = std::ranges::find_if(queues_, [&](const Queue& q) {
    return !q.lane->is_list && q.lane->name == photo.contributor;
  });
  if (queue == queues_.end()) {
    auto lane =
        std::make_shared<Lane>(Lane{.name = photo.contributor, .settles = settles_, .stop = {}});
    queue = queues_.insert(queues_.end(), Queue{std::move(lane), {}});
  }
  return Join(queue, number, std::move(photo));
}

Ticket SubmissionLine::Join(std::list<Queue>::iterator queue, uint64_t number, WaitingPhoto photo) {
  photo.ticket = std::make_shared<PhotoProgress>(number);
  photo.lane = queue->lane;
  Ticket ticket(photo.ticket);
  queue->photos.push_back(std::move(photo));
  return ticket;
}

Ticket SubmissionLine::Answered(uint64_t number, AddOutcome outcome) {
  auto progress = std::make_shared<PhotoProgress>(number);
  progress->phase = PhotoProgress::Phase::kAnswered;
  progress->answer = std::move(outcome);
  progress->is_settled = true;
  return Ticket(std::move(progress));
}

bool SubmissionLine::Take(WaitingPhoto* photo, bool of_lists, bool of_contributors) {
  const std::lock_guard lock(mutex_);
  const auto first = std::find_if(queues_.begin(), queues_.end(), [&](const Queue& queue) {
    return queue.lane->is_list ? of_lists : of_contributors;
  });
  if (first == queues_.end()) return false;
  *photo = std::move(first->photos.front());
  first->photos.pop_front();
  if (first->photos.empty()) {
    queues_.erase(first);
  } else {
    queues_.splice(queues_.end(), queues_, first);
  }
  return true;
}

bool SubmissionLine::is_empty() const {
  const std::lock_guard lock(mutex_);
  return queues_.empty();
}

const std::shared_ptr<PhotoProgress>& SubmissionLine::ProgressOf(const Ticket& ticket) {
  return ticket.progress_;
}

}  // namespace veduta
