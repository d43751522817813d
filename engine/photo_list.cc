// SPDX-License-Identifier: Apache-2.0
#include "engine/photo_list.h"

#include <deque>
#include <optional>
#include <utility>

namespace veduta {
namespace {

// Ends the list however AddPhotos is left: by its end, by an error, or by a report that throws.
class ListEnd final {
 public:
  ListEnd(Scheduler* scheduler, Lane* lane) : scheduler_(scheduler), lane_(lane) {}
  ListEnd(const ListEnd&) = delete;
  ListEnd& operator=(const ListEnd&) = delete;
  ~ListEnd() { scheduler_->EndList(lane_); }

 private:
  Scheduler* const scheduler_;
  Lane* const lane_;
};

}  // namespace

Status AddList(EngineParts* parts, std::span<const PhotoSubmission> photos,
               std::span<const AwaitedPose> awaited,
               const std::function<void(const AddOutcome&)>& report, const std::stop_token& stop,
               const std::function<void(const FollowUp&)>& followed) {
  // A camera that is not there is said before anything is added.
  std::vector<std::optional<CameraRecord>> cameras;
  for (const PhotoSubmission& photo : photos) {
    VEDUTA_ASSIGN_OR_RETURN(std::optional<CameraRecord> camera, parts->FindNamed(photo.camera));
    cameras.push_back(std::move(camera));
  }
  Scheduler& scheduler = *parts->scheduler;
  const std::shared_ptr<Lane> lane = scheduler.OpenList(stop);
  const ListEnd end(&scheduler, lane.get());
  std::deque<Ticket> tickets;
  size_t submitted = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    for (; submitted < photos.size() && tickets.size() <= scheduler.window(); ++submitted) {
      const PhotoSubmission& next = photos[submitted];
      tickets.push_back(scheduler.SubmitToList(
          lane, next.photo, cameras[submitted], next.contributor,
          awaited.empty() ? std::nullopt : std::optional(awaited[submitted])));
    }
    std::vector<FollowUp> steps;
    Result<AddOutcome> outcome = Scheduler::WaitSettled(tickets.front(), &steps);
    tickets.pop_front();
    if (!outcome.ok() && stop.stop_requested() &&
        outcome.status().code() == StatusCode::kCancelled) {
      return Status::Cancelled("stopped after " + std::to_string(i) + " of " +
                               std::to_string(photos.size()) +
                               " photos; run the same command again to go on");
    }
    if (!outcome.ok()) return outcome.status();  // the list has ended: no later photo is applied
    for (const FollowUp& step : steps) {
      if (followed) followed(step);
      outcome->propagated.insert(outcome->propagated.end(), step.placed.begin(), step.placed.end());
      outcome->unplaced.insert(outcome->unplaced.end(), step.unplaced.begin(), step.unplaced.end());
      outcome->split_off.insert(outcome->split_off.end(), step.split_off.begin(),
                                step.split_off.end());
    }
    if (report) report(*outcome);
    scheduler.Release(lane.get());
  }
  return Status::Ok();
}

}  // namespace veduta
