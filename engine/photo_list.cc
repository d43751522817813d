// SPDX-License-Identifier: Apache-2.0
#include "engine/photo_list.h"

#include <algorithm>
#include <deque>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "engine/first_cameras.h"

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

// Where more photos than these wait for a camera they are tried again while so large a share of
// those that were tried has got one. Chosen by hand.
constexpr size_t kTriedAgainAlways = 100;
constexpr double kTriedAgainShareMin = 0.05;

class ListAdding final {
 public:
  using Report = std::function<void(const AddOutcome&)>;
  using Followed = std::function<void(const FollowUp&)>;

  ListAdding(EngineParts* parts, std::span<const PhotoSubmission> photos,
             std::span<const AwaitedPose> awaited, const std::stop_token& stop)
      : scheduler_(*parts->scheduler),
        photos_(photos),
        awaited_(awaited),
        stop_(stop),
        lane_(scheduler_.OpenList(stop)),
        end_(&scheduler_, lane_.get()) {}

  Status FindCameras(EngineParts* parts) {
    for (const PhotoSubmission& photo : photos_) {
      VEDUTA_ASSIGN_OR_RETURN(std::optional<CameraRecord> camera, parts->FindNamed(photo.camera));
      if (camera) camera->awaited = nullptr;  // much, and one for each photo
      cameras_.push_back(std::move(camera));
    }
    return Status::Ok();
  }

  // Photos whose camera cannot be estimated yet are tried again once the others are there, until
  // nothing comes of it, or little where they are many. So the order in which photos are stored is
  // the same where this was interrupted and is done again; those of `tried` begin with the second
  // round then.
  Status AddAll(std::vector<size_t> tried, const Report& report, const Followed& followed) {
    std::vector<size_t> all(photos_.size()), round;
    std::iota(all.begin(), all.end(), 0);
    std::ranges::set_difference(all, tried, std::back_inserter(round));
    std::map<size_t, AddOutcome> waiting;
    bool is_first = true;
    for (bool goes_on = true; goes_on && !round.empty();) {
      waiting.clear();
      VEDUTA_RETURN_IF_ERROR(AddRound(round, report, followed, &waiting));
      const size_t added = round.size() - waiting.size();
      const double share =
          is_first || waiting.size() <= kTriedAgainAlways ? 0 : kTriedAgainShareMin;
      goes_on =
          !tried.empty() || static_cast<double>(added) > share * static_cast<double>(round.size());
      is_first = false;
      round = std::exchange(tried, {});
      for (const auto& [photo, outcome] : waiting) round.push_back(photo);
      std::ranges::sort(round);
    }
    for (const auto& [photo, outcome] : waiting) {
      if (report) report(outcome);
    }
    return Status::Ok();
  }

  // The photos of the list that are stored.
  Result<std::set<ContentHash>> ListStored(const Snapshot& after) const {
    std::set<ContentHash> stored;
    for (const PhotoSubmission& photo : photos_) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> id,
                              after.FindImageByName(photo.photo.name, photo.contributor));
      if (!id) continue;
      VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, after.GetImage(*id));
      stored.insert(image.photo);
    }
    return stored;
  }

  // The photos without a camera that an interrupted try of the same list has passed over in its
  // last round: those before the photo that was stored last.
  Result<std::vector<size_t>> ListTried(const Snapshot& before) const {
    std::vector<size_t> unknown;
    ImageId last;
    size_t end = 0;
    for (size_t i = 0; i < photos_.size(); ++i) {
      VEDUTA_ASSIGN_OR_RETURN(
          const std::optional<ImageId> stored,
          before.FindImageByName(photos_[i].photo.name, photos_[i].contributor));
      if (!stored && !cameras_[i]) unknown.push_back(i);
      if (!stored || *stored < last) continue;
      last = *stored;
      end = i;
    }
    std::erase_if(unknown, [&](size_t i) { return i >= end; });
    return unknown;
  }

 private:
  // Reports all but those that are tried again, whose outcome goes into `waiting`.
  Status AddRound(const std::vector<size_t>& round, const Report& report, const Followed& followed,
                  std::map<size_t, AddOutcome>* waiting) {
    std::deque<Ticket> tickets;
    size_t submitted = 0;
    for (const size_t i : round) {
      for (; submitted < round.size() && tickets.size() <= scheduler_.window(); ++submitted)
        tickets.push_back(Submit(round[submitted]));
      std::vector<FollowUp> steps;
      Result<AddOutcome> outcome = Scheduler::WaitSettled(tickets.front(), &steps);
      tickets.pop_front();
      if (!outcome.ok() && stop_.stop_requested() &&
          outcome.status().code() == StatusCode::kCancelled) {
        return Status::Cancelled("stopped after " + std::to_string(done_) + " of " +
                                 std::to_string(photos_.size()) +
                                 " photos; run the same command again to go on");
      }
      if (!outcome.ok()) return outcome.status();  // the list has ended: no later photo is applied
      for (const FollowUp& step : steps) {
        if (followed) followed(step);
        AddStep(step, &*outcome);
      }
      if (!cameras_[i] && outcome->failure.code() == StatusCode::kNotFound) {
        waiting->emplace(i, *std::move(outcome));
      } else {
        ++done_;
        if (report) report(*outcome);
      }
      scheduler_.Release(lane_.get());
    }
    return Status::Ok();
  }

  Ticket Submit(size_t i) {
    const PhotoSubmission& photo = photos_[i];
    return scheduler_.SubmitToList(lane_, photo.photo, cameras_[i], photo.contributor,
                                   awaited_.empty() ? std::nullopt : std::optional(awaited_[i]));
  }

  static void AddStep(const FollowUp& step, AddOutcome* outcome) {
    outcome->propagated.insert(outcome->propagated.end(), step.placed.begin(), step.placed.end());
    outcome->unplaced.insert(outcome->unplaced.end(), step.unplaced.begin(), step.unplaced.end());
    outcome->split_off.insert(outcome->split_off.end(), step.split_off.begin(),
                              step.split_off.end());
  }

  Scheduler& scheduler_;
  const std::span<const PhotoSubmission> photos_;
  const std::span<const AwaitedPose> awaited_;
  const std::stop_token& stop_;
  const std::shared_ptr<Lane> lane_;
  const ListEnd end_;
  std::vector<std::optional<CameraRecord>> cameras_;
  size_t done_ = 0;
};

}  // namespace

Status AddList(EngineParts* parts, std::span<const PhotoSubmission> photos,
               std::span<const AwaitedPose> awaited,
               const std::function<void(const AddOutcome&)>& report, const std::stop_token& stop,
               const std::function<void(const FollowUp&)>& followed) {
  ListAdding list(parts, photos, awaited, stop);
  // A camera that is not there is said before anything is added.
  VEDUTA_RETURN_IF_ERROR(list.FindCameras(parts));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<size_t> tried,
                          list.ListTried(*parts->database->GetSnapshot()));
  VEDUTA_RETURN_IF_ERROR(list.AddAll(std::move(tried), report, followed));
  VEDUTA_ASSIGN_OR_RETURN(const bool awaits, AwaitsPhotos(*parts->database->GetSnapshot()));
  if (!awaits) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const std::set<ContentHash> stored,
                          list.ListStored(*parts->database->GetSnapshot()));
  return EndAwaiting(parts, stored);
}

}  // namespace veduta
