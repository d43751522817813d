// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/submaps.h"

#include <algorithm>
#include <utility>

#include "engine/mapping/covisible_images.h"

namespace veduta {
namespace {

// Images that are asked which submap is nearest. Chosen by hand; not measured.
constexpr size_t kAskedMax = 12;

// A part of so many images that is merged is not spread over the submaps around it: it becomes a
// submap of its own, which is parted where it is too large, and the seam is due. Chosen by hand;
// not measured.
constexpr size_t kOwnSubmapMin = 15;

bool IsDue(const SubmapRecord& submap, const AdjustmentSchedule& schedule) {
  return !submap.images.empty() &&
         (submap.images_at_adjustment == 0 || submap.images.size() > schedule.submap_images_max ||
          submap.images.size() >= submap.images_at_adjustment + schedule.submap_views_step);
}

}  // namespace

Result<Submaps> Submaps::Read(const Snapshot& snapshot) {
  Submaps submaps;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<SubmapRecord> all, snapshot.ListSubmaps());
  for (SubmapRecord& record : all) submaps.Add(std::move(record));
  return submaps;
}

SubmapRecord& Submaps::Add(SubmapRecord record) {
  for (const ImageId image : record.images) submap_of_[image] = record.id;
  submaps_of_[record.reconstruction].insert(record.id);
  return records_[record.id] = std::move(record);
}

const std::set<SubmapId>& Submaps::AllOf(ReconstructionId reconstruction) const {
  static const std::set<SubmapId> kNone;
  const auto found = submaps_of_.find(reconstruction);
  return found == submaps_of_.end() ? kNone : found->second;
}

bool Submaps::IsParted(ReconstructionId reconstruction) const {
  return std::ranges::any_of(AllOf(reconstruction),
                             [&](SubmapId id) { return !records_.at(id).images.empty(); });
}

const SubmapRecord* Submaps::Find(SubmapId id) const {
  const auto found = records_.find(id);
  return found != records_.end() && !found->second.images.empty() ? &found->second : nullptr;
}

const SubmapRecord* Submaps::FindOf(ImageId image) const {
  const auto found = submap_of_.find(image);
  return found == submap_of_.end() ? nullptr : &records_.at(found->second);
}

SubmapRecord* Submaps::MutableOf(ImageId image) {
  const SubmapRecord* const found = FindOf(image);
  return found == nullptr ? nullptr : &records_.at(found->id);
}

std::vector<SubmapId> Submaps::List(ReconstructionId reconstruction) const {
  std::vector<SubmapId> all;
  for (const SubmapId id : AllOf(reconstruction)) {
    if (!records_.at(id).images.empty()) all.push_back(id);
  }
  return all;
}

std::vector<SubmapId> Submaps::ListMoving(ReconstructionId reconstruction) const {
  std::vector<SubmapId> moving = List(reconstruction);
  std::erase_if(moving, [&](SubmapId id) { return !records_.at(id).motion; });
  return moving;
}

std::vector<SubmapId> Submaps::ListDue(ReconstructionId reconstruction,
                                       const AdjustmentSchedule& schedule) const {
  std::vector<SubmapId> due;
  for (const SubmapId id : AllOf(reconstruction)) {
    if (IsDue(records_.at(id), schedule)) due.push_back(id);
  }
  return due;
}

SubmapRecord& Submaps::Make(ReconstructionId reconstruction, std::vector<ImageId> images) {
  const SubmapId id(records_.empty() ? 1 : records_.rbegin()->first.value + 1);
  std::ranges::sort(images);
  changed_.insert(id);
  return Add({id, reconstruction, std::move(images), 0, std::nullopt});
}

void Submaps::Erase(ImageId image) {
  SubmapRecord* const record = MutableOf(image);
  if (record == nullptr) return;
  std::erase(record->images, image);
  submap_of_.erase(image);
  record->images_at_adjustment =
      std::min(record->images_at_adjustment, static_cast<uint32_t>(record->images.size()));
  changed_.insert(record->id);
}

void Submaps::Insert(SubmapId id, ImageId image) {
  std::vector<ImageId>& images = records_.at(id).images;
  images.insert(std::ranges::upper_bound(images, image), image);
  submap_of_[image] = id;
  changed_.insert(id);
}

// Follows images that are in reconstruction `into` now. Where that one has submaps, a whole submap
// goes over as it is, and a part of a submap becomes a new one.
void Submaps::MoveAway(SubmapId from, ReconstructionId into, std::span<const ImageId> images) {
  SubmapRecord& record = records_.at(from);
  if (IsParted(into) && images.size() == record.images.size()) {
    submaps_of_[record.reconstruction].erase(from);
    submaps_of_[into].insert(from);
    record.reconstruction = into;
    record.motion.reset();  // it was meant for another frame
    changed_.insert(from);
    return;
  }
  for (const ImageId id : images) Erase(id);
  if (IsParted(into)) Make(into, {images.begin(), images.end()});
}

std::vector<ImageId> Submaps::JoinNearest(const CityMap& map, std::vector<ImageId> images) {
  const auto join = [&](ImageId id) {
    for (const ImageId near : CovisibleImages(map, id, kAskedMax)) {
      const SubmapRecord* const found = FindOf(near);
      if (found == nullptr || found->reconstruction != map.image(id).reconstruction) continue;
      Insert(found->id, id);
      return true;
    }
    return false;
  };
  // An image that has joined a submap may lead the next image to it.
  for (size_t before = images.size() + 1; images.size() < before;) {
    before = images.size();
    std::erase_if(images, join);
  }
  return images;
}

Status Submaps::Follow(const CityMap& map, const Snapshot& base) {
  if (records_.empty()) return Status::Ok();
  for (const auto& [image, reconstruction] : map.changes().unplaced) Erase(image);
  std::map<std::pair<SubmapId, ReconstructionId>, std::vector<ImageId>> moved;
  // By the reconstruction that they come from, if any, and the one where they are.
  std::map<std::pair<ReconstructionId, ReconstructionId>, std::vector<ImageId>> come;
  for (const ImageId id : map.changes().poses) {
    const ReconstructionId now = map.image(id).reconstruction;
    if (const SubmapRecord* const known = FindOf(id)) {
      if (known->reconstruction != now) moved[{known->id, now}].push_back(id);
    } else if (IsParted(now)) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> before, base.FindPose(id));
      come[{before ? before->reconstruction : ReconstructionId(), now}].push_back(id);
    }
  }
  for (const auto& [where, images] : moved) MoveAway(where.first, where.second, images);
  for (const auto& [where, images] : come) {
    std::vector<ImageId> left = images;
    if (!where.first.valid() || images.size() < kOwnSubmapMin)
      left = JoinNearest(map, std::move(left));
    if (!left.empty()) Make(where.second, std::move(left));
  }
  return Status::Ok();
}

Status Submaps::FollowPlacement(const CityMap& map, const Snapshot& base,
                                const Placement& placement) {
  if (records_.empty()) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(Follow(map, base));
  if (placement.doubtful.valid()) MakeDue({&placement.doubtful, 1});
  for (const Merge& merge : placement.merges) {
    if (merge.from == placement.founded) continue;
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord from, base.GetReconstruction(merge.from));
    if (from.image_count >= kOwnSubmapMin) MakeDue(placement.around);
  }
  return Status::Ok();
}

void Submaps::MakeDue(std::span<const ImageId> images) {
  for (const ImageId id : images) {
    SubmapRecord* const record = MutableOf(id);
    if (record == nullptr) continue;
    record->images_at_adjustment = 0;
    changed_.insert(record->id);
  }
}

void Submaps::NoteAdjusted(ReconstructionId reconstruction) {
  for (const SubmapId id : AllOf(reconstruction)) {
    NoteAdjusted(id);
    SetMotion(id, std::nullopt);
    without_border_.insert(id);
  }
}

void Submaps::NoteAdjusted(SubmapId id) {
  SubmapRecord& record = records_.at(id);
  record.images_at_adjustment = static_cast<uint32_t>(record.images.size());
  changed_.insert(id);
}

void Submaps::SetMotion(SubmapId id, const std::optional<Sim3>& motion) {
  records_.at(id).motion = motion;
  changed_.insert(id);
}

void Submaps::Part(ReconstructionId reconstruction, std::span<const std::vector<ImageId>> parts) {
  for (const std::vector<ImageId>& part : parts) {
    for (const ImageId id : part) Erase(id);
  }
  for (const std::vector<ImageId>& part : parts) Make(reconstruction, part);
}

void Submaps::Join(SubmapId from, SubmapId into) {
  const std::vector<ImageId> images = records_.at(from).images;
  for (const ImageId id : images) {
    Erase(id);
    Insert(into, id);
  }
  records_.at(into).images_at_adjustment = 0;
}

void Submaps::Write(Transaction* transaction) const {
  for (const SubmapId id : changed_) {
    const SubmapRecord& record = records_.at(id);
    if (record.images.empty() || without_border_.contains(id)) transaction->DeleteSubmap(id);
    if (!record.images.empty()) transaction->PutSubmap(record);
  }
}

}  // namespace veduta
