// SPDX-License-Identifier: Apache-2.0
// Reconstructions, poses, points and observations. The tracks of the points say what is seen where;
// observations and sums follow from them. A photo that has lost its pose is tried again.
#include <algorithm>
#include <cmath>

#include "engine/query/checked_city.h"
#include "engine/repair/healing.h"

namespace veduta {
namespace {

std::string Name(ReconstructionId id) {
  return "reconstruction " + std::to_string(id.value);
}

// Sums of errors that agree within this share are taken for the same, as `verify` does.
constexpr double kErrorSumShare = 1e-3;

class ReconstructionHealer {
 public:
  // `city` has the cameras and the images of the healing: it tells where features lie.
  ReconstructionHealer(const ReconstructionRecord& record, std::map<ImageId, PoseRecord> poses,
                       const CheckedCity& city, HealingWork* healing)
      : record_(record), poses_(std::move(poses)), city_(city), healing_(healing) {}

  Status Run() {
    VEDUTA_RETURN_IF_ERROR(ReadBlocks());
    RehomePoints();
    VEDUTA_RETURN_IF_ERROR(CompareObservations());
    DropUnseen();
    NoteLosses();
    if (poses_.size() < 3) return GiveUp();
    return Write();
  }
  bool is_given_up() const { return poses_.empty(); }
  std::set<ImageId> members() const {
    std::set<ImageId> members;
    for (const auto& [id, pose] : poses_) members.insert(id);
    return members;
  }
  const ReconstructionRecord& record() const { return record_; }

 private:
  // The features of a point that are there and that no other point has.
  void CleanTrack(PointRecord* point) {
    std::erase_if(point->track, [&](const TrackElement& element) {
      if (!poses_.contains(element.image) ||
          element.feature >= healing_->images.at(element.image).feature_count)
        return true;
      return !taken_.insert({element.image, element.feature}).second;
    });
  }

  // The mean error of a point anew; a track that cannot be measured is emptied.
  void MeasureAgain(PointRecord* point) {
    const std::optional<double> error_px = MeasureErrorPx(city_, poses_, *point);
    if (!error_px || !std::isfinite(*error_px)) return DropTrack(point);
    point->error_px = static_cast<float>(*error_px);
  }

  // Measures the error of a point again where `verify` would find that it is not the recorded one.
  void CheckError(PointRecord* point) {
    const std::optional<double> error_px = MeasureErrorPx(city_, poses_, *point);
    if (!error_px || IsErrorRecorded(*point, *error_px)) return;
    ++remeasured_;
    MeasureAgain(point);
    if (point->track.empty()) ++unmeasurable_;
  }

  void DropTrack(PointRecord* point) {
    for (const TrackElement& element : point->track) taken_.erase({element.image, element.feature});
    point->track.clear();
  }

  void TakePoints(PointBlock block) {
    const size_t before = block.points.size();
    for (PointRecord& point : block.points) {
      const size_t length = point.track.size();
      CleanTrack(&point);
      if (point.track.size() == length) {
        CheckError(&point);
        continue;
      }
      ++shortened_;
      if (point.track.size() < 2) {
        DropTrack(&point);
      } else {
        MeasureAgain(&point);
      }
    }
    std::erase_if(block.points, [](const PointRecord& point) { return point.track.size() < 2; });
    dropped_ += before - block.points.size();
    if (poses_.contains(block.home)) {
      blocks_[block.home] = std::move(block);
    } else {
      homeless_.insert(homeless_.end(), block.points.begin(), block.points.end());
    }
  }

  Status ReadBlocks() {
    for (uint32_t id = 1; id < healing_->state.next_image; ++id) {
      const ImageId home(id);
      Result<PointBlock> block =
          healing_->from().GetPointBlock(record_.id, record_.points_generation, home);
      if (block.ok()) {
        if (!block->points.empty() || block->next_ordinal != 1) TakePoints(std::move(*block));
        continue;
      }
      if (!IsDamage(block.status())) return block.status();
      lost_blocks_.insert(home);
    }
    return Status::Ok();
  }

  // Points whose home is gone move to the first image that sees them.
  void RehomePoints() {
    for (PointRecord& point : homeless_) {
      const ImageId home = point.track.front().image;
      PointBlock& block = blocks_[home];
      block.home = home;
      point.id = {home, block.next_ordinal++};
      block.points.push_back(std::move(point));
    }
  }

  // Derives the observations from the points, and counts the images whose stored ones differ. A
  // stored observation may name a point of a lost block: the number of that point is not used
  // again.
  Status CompareObservations() {
    for (const auto& [home, block] : blocks_) {
      for (const PointRecord& point : block.points) {
        for (const TrackElement& element : point.track)
          observations_[element.image].push_back({element.feature, point.id});
      }
    }
    for (const auto& [id, pose] : poses_) {
      std::vector<Observation>& observations = observations_[id];
      std::ranges::sort(observations, {}, &Observation::feature);
      const Result<std::vector<Observation>> stored = healing_->from().GetObservations(id);
      if (!stored.ok() && !IsDamage(stored.status())) return stored.status();
      if (!stored.ok() || *stored != observations) ++other_observations_;
      if (!stored.ok()) continue;
      for (const Observation& observation : *stored) {
        if (!lost_blocks_.contains(observation.point.home)) continue;
        PointBlock& block = blocks_[observation.point.home];
        block.home = observation.point.home;
        block.next_ordinal = std::max(block.next_ordinal, observation.point.ordinal + 1);
      }
    }
    std::erase_if(blocks_, [&](const auto& entry) { return !poses_.contains(entry.first); });
    return Status::Ok();
  }

  // A pose that has lost all of its points is no longer held by anything.
  void DropUnseen() {
    if (lost_blocks_.empty() && dropped_ == 0) return;
    std::erase_if(poses_, [&](const auto& entry) {
      const bool unseen = observations_[entry.first].empty();
      if (unseen) unseen_.push_back(entry.first);
      return unseen;
    });
    std::erase_if(blocks_, [&](const auto& entry) { return !poses_.contains(entry.first); });
  }

  void NoteLosses() {
    RepairNotes& notes = healing_->notes;
    if (!lost_blocks_.empty()) {
      notes.Add("the points of " + std::to_string(lost_blocks_.size()) + " photos in " +
                    Name(record_.id) + " cannot be read",
                "they are left out; later photos bring new ones");
    }
    dropped_ -= unmeasurable_;
    if (dropped_ + shortened_ > 0) {
      notes.Add(std::to_string(shortened_) + " points of " + Name(record_.id) +
                    " are seen by features that are not there",
                "those features are left out, and with them " + std::to_string(dropped_) +
                    " points that fewer than two photos see");
    }
    if (remeasured_ > 0) {
      notes.Add(std::to_string(remeasured_) + " points of " + Name(record_.id) +
                    " have another error than the one that they record",
                "their errors are measured again, and points that no photo can see are left out");
    }
    if (other_observations_ > 0) {
      notes.Add("the observations of " + std::to_string(other_observations_) + " photos in " +
                    Name(record_.id) + " cannot be read or are not those of its points",
                "they are derived from the points");
    }
  }

  // Too few photos are left for a reconstruction.
  Status GiveUp() {
    healing_->notes.Add(Name(record_.id) + " has fewer than three photos left",
                        "its photos are tried again");
    for (const auto& [id, pose] : poses_) unseen_.push_back(id);
    poses_.clear();
    return TryUnseenAgain();
  }

  Status TryUnseenAgain() {
    for (const ImageId id : unseen_) VEDUTA_RETURN_IF_ERROR(healing_->TryAgain(id));
    return Status::Ok();
  }

  void Recount() {
    uint64_t points = 0, observations = 0;
    double error_sum = 0;
    for (const auto& [home, block] : blocks_) {
      for (const PointRecord& point : block.points) {
        ++points;
        observations += point.track.size();
        error_sum += static_cast<double>(point.error_px) * static_cast<double>(point.track.size());
      }
    }
    const ReconstructionRecord before = record_;
    record_.image_count = static_cast<uint32_t>(poses_.size());
    record_.point_count = points;
    record_.observation_count = observations;
    const bool sum_holds =
        std::abs(error_sum - record_.reprojection_error_px_sum) <= kErrorSumShare * (1 + error_sum);
    if (!sum_holds) record_.reprojection_error_px_sum = error_sum;
    const bool holds = sum_holds && before.image_count == record_.image_count &&
                       before.point_count == points && before.observation_count == observations;
    if (!holds)
      healing_->notes.Add("the sums of " + Name(record_.id) + " are off", "they are counted again");
  }

  Status Write() {
    Recount();
    HealedWriter& writer = healing_->writer;
    VEDUTA_RETURN_IF_ERROR(
        writer.Put([&](Transaction& transaction) { transaction.PutReconstruction(record_); }));
    for (const auto& [id, pose] : poses_) {
      VEDUTA_RETURN_IF_ERROR(writer.Put([&, id = id, &pose = pose](Transaction& transaction) {
        transaction.PutPose(pose);
        transaction.PutObservations(id, observations_[id]);
      }));
    }
    for (const auto& [home, block] : blocks_) {
      VEDUTA_RETURN_IF_ERROR(writer.Put([&, &block = block](Transaction& transaction) {
        transaction.PutPointBlock(record_.id, record_.points_generation, block);
      }));
    }
    return TryUnseenAgain();
  }

  ReconstructionRecord record_;
  std::map<ImageId, PoseRecord> poses_;
  const CheckedCity& city_;
  HealingWork* const healing_;
  std::map<ImageId, PointBlock> blocks_;
  std::map<ImageId, std::vector<Observation>> observations_;
  std::vector<PointRecord> homeless_;
  std::set<std::pair<ImageId, FeatureIndex>> taken_;
  std::set<ImageId> lost_blocks_;
  std::vector<ImageId> unseen_;
  uint64_t dropped_ = 0, shortened_ = 0, remeasured_ = 0, unmeasurable_ = 0,
           other_observations_ = 0;
};

struct StoredMap {
  std::map<ReconstructionId, ReconstructionRecord> living, gone;  // gone: merged or dissolved
  std::map<ReconstructionId, std::map<ImageId, PoseRecord>> poses;
};

// Far more than a reconstruction is ever adjusted. Chosen by hand.
constexpr uint32_t kGenerationMax = 1000;

// The generation of which there are points; 0 where there is none.
uint32_t FindGeneration(ReconstructionId id, const HealingWork& healing) {
  for (uint32_t generation = 1; generation <= kGenerationMax; ++generation) {
    bool found = false;
    healing.from()
        .ScanPointBlocks(id, generation,
                         [&](const PointBlock&) {
                           found = true;
                           return false;
                         })
        .IgnoreBecause("a block that cannot be read is noticed when its points are taken");
    if (found) return generation;
  }
  return 0;
}

// Makes a new record for a reconstruction whose own is lost; nothing where none of its points is
// left. Its sums are counted in any case. Whether any pose names it shows later.
std::optional<ReconstructionRecord> RecoverReconstruction(ReconstructionId id,
                                                          const HealingWork& healing) {
  ReconstructionRecord record;
  record.id = id;
  record.points_generation = FindGeneration(id, healing);
  if (record.points_generation == 0) return std::nullopt;
  record.images_at_adjustment = static_cast<uint32_t>(healing.told.ImagesAtAdjustment(id));
  // Every change of the geometry has an entry in the journal: no earlier version is greater.
  record.geometry_version = healing.state.next_journal;
  return record;
}

Status ReadReconstructions(StoredMap* map, HealingWork* healing) {
  const auto read = [&](ReconstructionId id) -> Result<bool> {
    const Result<ReconstructionRecord> record = healing->from().GetReconstruction(id);
    if (record.ok()) {
      (record->is_living() ? map->living : map->gone)[id] = *record;
      return true;
    }
    if (!IsDamage(record.status())) return record.status();
    if (record.status().code() == StatusCode::kNotFound &&
        id.value >= healing->state.next_reconstruction)
      return false;
    const auto recovered = RecoverReconstruction(id, *healing);
    if (recovered) map->living[id] = *recovered;
    healing->notes.Add(Name(id) + " cannot be read: " + record.status().message(),
                       recovered ? "its record is made again from its points"
                                 : "the photos that are in it are tried again");
    return true;
  };
  VEDUTA_RETURN_IF_ERROR(
      VisitIds<ReconstructionId>(*healing, healing->state.next_reconstruction, read));
  for (const auto& records : {map->living, map->gone}) {
    if (records.empty()) continue;
    healing->state.next_reconstruction =
        std::max(healing->state.next_reconstruction, records.rbegin()->first.value + 1);
  }
  return Status::Ok();
}

// The image's pose goes into `map`, or the image is tried again.
Status ReadPose(const ImageRecord& image, StoredMap* map, HealingWork* healing) {
  const Result<std::optional<PoseRecord>> pose = healing->from().FindPose(image.id);
  if (!pose.ok() && !IsDamage(pose.status())) return pose.status();
  const bool is_placed = image.verdict != Verdict::kPostponed;
  const bool has_pose = pose.ok() && pose->has_value();
  const Result<bool> forbidden =
      healing->from().IsForbidden(ForbiddenKind::kPose, image.id.value, image.id.value);
  if (!forbidden.ok() && !IsDamage(forbidden.status())) return forbidden.status();
  const bool is_forbidden = forbidden.ok() && *forbidden;
  if (has_pose && is_placed && !is_forbidden && map->living.contains((*pose)->reconstruction)) {
    map->poses[(*pose)->reconstruction][image.id] = **pose;
    return Status::Ok();
  }
  if (!is_placed && pose.ok() && !has_pose) return Status::Ok();
  std::string damage = "the pose of " + PhotoText(image);
  if (!pose.ok()) {
    damage += " cannot be read: " + pose.status().message();
  } else if (!has_pose) {
    damage += " is missing";
  } else if (is_forbidden) {
    damage += " is stored, and somebody has forbidden it";
  } else {
    damage += is_placed ? " lies in a reconstruction that is not there"
                        : " is stored, and its record says that it has none";
  }
  healing->notes.Add(std::move(damage),
                     is_forbidden ? "it is left out" : "the photo is tried again");
  return healing->TryAgain(image.id);
}

// Follows merges to the end: one that lives, or was dissolved.
bool HasEnd(const StoredMap& map, ReconstructionId id) {
  for (size_t step = 0; step <= map.gone.size(); ++step) {
    if (map.living.contains(id)) return true;
    const auto gone = map.gone.find(id);
    if (gone == map.gone.end()) return false;
    if (gone->second.is_dissolved) return true;
    id = gone->second.merged_into;
  }
  return false;  // they go round in a circle
}

// Reconstructions that are no more. Numbers have no gaps: one of which nothing is left counts as
// dissolved.
Status WriteGone(const StoredMap& map, HealingWork* healing) {
  for (uint32_t number = 1; number < healing->state.next_reconstruction; ++number) {
    const ReconstructionId id(number);
    if (map.living.contains(id)) continue;
    ReconstructionRecord record;
    if (HasEnd(map, id)) {
      record = map.gone.at(id);
    } else {
      record.is_dissolved = true;
      record.images_at_adjustment = static_cast<uint32_t>(healing->told.ImagesAtAdjustment(id));
    }
    record.id = id;
    if (record.is_dissolved) record.merged_into = {}, record.merged_from_this = {};
    record.image_count = 0;
    record.point_count = record.observation_count = 0;
    record.reprojection_error_px_sum = 0;
    record.georeference = Georeference();
    healing->reconstructions[id] = record;
    VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
        [&](Transaction& transaction) { transaction.PutReconstruction(record); }));
  }
  return Status::Ok();
}

}  // namespace

Status HealMap(HealingWork* healing) {
  StoredMap map;
  VEDUTA_RETURN_IF_ERROR(ReadReconstructions(&map, healing));
  for (auto& [id, image] : healing->images) {
    if (healing->FindPhoto(id) == nullptr) continue;
    VEDUTA_RETURN_IF_ERROR(ReadPose(image, &map, healing));
  }
  CheckedCity city(healing->from(), /*is_deep=*/false, /*prepares=*/nullptr);
  city.cameras = healing->cameras;
  city.images = healing->images;
  for (auto it = map.living.begin(); it != map.living.end();) {
    ReconstructionHealer healer(it->second, map.poses[it->first], city, healing);
    VEDUTA_RETURN_IF_ERROR(healer.Run());
    if (!healer.is_given_up()) {
      healing->reconstructions[it->first] = healer.record();
      healing->members[it->first] = healer.members();
    }
    it = healer.is_given_up() ? map.living.erase(it) : std::next(it);
  }
  return WriteGone(map, healing);
}

}  // namespace veduta
