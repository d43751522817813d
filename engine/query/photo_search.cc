// SPDX-License-Identifier: Apache-2.0
#include "engine/query/photo_search.h"

#include <algorithm>
#include <map>

#include "engine/earth/earth_pose.h"
#include "engine/query/visibility.h"

namespace veduta {
namespace {

// What is read once for many photos.
class PhotoTeller final {
 public:
  PhotoTeller(const Snapshot& snapshot, std::shared_ptr<const UnsureImages> unsure)
      : snapshot_(snapshot), unsure_(std::move(unsure)) {}

  // Whatever places the photo.
  Status TellPlace(const ImageRecord& image, FoundPhoto* photo) {
    photo->gps = image.gps;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_.FindPose(image.id));
    if (!pose) return Status::Ok();
    photo->reconstruction = pose->reconstruction;
    if (unsure_->contains(image.id)) return Status::Ok();
    auto found = georeferences_.find(pose->reconstruction);
    if (found == georeferences_.end()) {
      VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                              snapshot_.GetReconstruction(pose->reconstruction));
      found = georeferences_.emplace(pose->reconstruction, record.georeference).first;
    }
    const Georeference& georeference = found->second;
    if (georeference.place)
      photo->on_earth =
          EarthPoseOf(*georeference.place, georeference.version, pose->cam_from_world);
    return Status::Ok();
  }

  // All the rest.
  Status TellMore(ImageRecord image, FoundPhoto* photo) {
    photo->id = image.id;
    photo->name = std::move(image.name);
    photo->contributor = std::move(image.contributor);
    photo->verdict = image.verdict;
    photo->sha256 = image.photo.Hex();
    photo->media_type = std::move(image.media_type);
    photo->width_px = image.width_px;
    photo->height_px = image.height_px;
    photo->size_bytes = image.size_bytes;
    photo->stored_unix_s = image.time_unix_s;
    photo->taken = image.taken;
    photo->contribution = image.contribution;
    if (image.contribution == 0) return Status::Ok();
    auto found = licences_.find(image.contribution);
    if (found == licences_.end()) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<ContributionRecord> contribution,
                              snapshot_.contributing().FindContribution(image.contribution));
      found =
          licences_.emplace(image.contribution, contribution ? contribution->licence : "").first;
    }
    photo->licence = found->second;
    return Status::Ok();
  }

 private:
  const Snapshot& snapshot_;
  const std::shared_ptr<const UnsureImages> unsure_;
  std::map<ReconstructionId, Georeference> georeferences_;
  std::map<uint32_t, std::string> licences_;
};

void TellTime(const ImageRecord& image, FoundPhoto* photo) {
  photo->taken_from_unix_s = kTakenUnixSMin;
  photo->taken_to_unix_s = image.time_unix_s;
  if (!image.taken) return;
  const TakenTime& taken = *image.taken;
  photo->taken_from_unix_s = taken.local_unix_s - taken.offset_s.value_or(kTakenOffsetSMax);
  photo->taken_to_unix_s = taken.local_unix_s - taken.offset_s.value_or(kTakenOffsetSMin);
}

bool IsThen(const PhotoSearch& search, const FoundPhoto& photo) {
  return (!search.taken_from_unix_s || photo.taken_to_unix_s >= *search.taken_from_unix_s) &&
         (!search.taken_to_unix_s || photo.taken_from_unix_s <= *search.taken_to_unix_s);
}

std::optional<GeoPosition> PositionOf(const FoundPhoto& photo) {
  if (photo.on_earth) return photo.on_earth->position;
  if (!photo.gps) return std::nullopt;
  return GeoPosition{photo.gps->latitude_deg, photo.gps->longitude_deg,
                     photo.gps->height_m.value_or(0)};
}

bool IsThere(const PhotoSearch& search, const FoundPhoto& photo) {
  if (!search.is_there) return true;
  const std::optional<GeoPosition> position = PositionOf(photo);
  return position && search.is_there(*position);
}

// Ascending ids to look at, one after the other.
class Candidates final {
 public:
  Candidates(const PhotoSearch& search, uint32_t next_image)
      : images_(search.images), next_(search.after.value + 1), end_(next_image) {
    std::ranges::sort(images_);
    images_.erase(std::unique(images_.begin(), images_.end()), images_.end());
  }

  // Not valid() after the last one.
  ImageId Next() {
    const ImageId least(next_);
    if (!images_.empty()) {
      const auto found = std::ranges::lower_bound(images_, least);
      next_ = found == images_.end() ? end_ : found->value;
    }
    return next_ < end_ ? ImageId(next_++) : ImageId();
  }

 private:
  std::vector<ImageId> images_;
  uint32_t next_;
  const uint32_t end_;
};

void Widen(const GeoPosition& position, PhotoExtent* extent) {
  if (!extent->south_west) extent->south_west = extent->north_east = position;
  GeoPosition &low = *extent->south_west, &high = *extent->north_east;
  low.latitude_deg = std::min(low.latitude_deg, position.latitude_deg);
  low.longitude_deg = std::min(low.longitude_deg, position.longitude_deg);
  high.latitude_deg = std::max(high.latitude_deg, position.latitude_deg);
  high.longitude_deg = std::max(high.longitude_deg, position.longitude_deg);
}

}  // namespace

Result<FoundPhotos> SearchPhotos(const Snapshot& snapshot, const PhotoSearch& search,
                                 UnsureCache* unsure, const Sight& sight) {
  const Visibility visibility(snapshot, sight);
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  VEDUTA_ASSIGN_OR_RETURN(auto all_unsure, unsure->Get(snapshot));
  PhotoTeller teller(snapshot, std::move(all_unsure));
  Candidates candidates(search, state.next_image);
  FoundPhotos found;
  uint32_t looked_at = 0;
  for (ImageId id = candidates.Next(); id.valid(); id = candidates.Next()) {
    if (found.photos.size() >= search.count_max || looked_at++ >= kSearchedPhotosMax) return found;
    found.next_after = id;
    Result<ImageRecord> image = snapshot.GetImage(id);
    if (image.status().code() == StatusCode::kNotFound) continue;  // it was removed
    VEDUTA_RETURN_IF_ERROR(image.status());
    FoundPhoto photo;
    TellTime(*image, &photo);
    if (image->verdict == Verdict::kRejected || !IsThen(search, photo)) continue;
    VEDUTA_RETURN_IF_ERROR(teller.TellPlace(*image, &photo));
    if (!IsThere(search, photo)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(*image));
    if (!sees) continue;
    VEDUTA_ASSIGN_OR_RETURN(photo.is_hidden, IsHidden(snapshot, *image));
    VEDUTA_RETURN_IF_ERROR(teller.TellMore(*std::move(image), &photo));
    found.photos.push_back(std::move(photo));
  }
  found.next_after = {};
  return found;
}

Result<PhotoExtent> ExtentOf(const Snapshot& snapshot, UnsureCache* unsure, const Sight& sight) {
  PhotoExtent extent;
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  if (state.next_image > kSearchedPhotosMax) return extent;
  PhotoSearch all;
  all.count_max = kSearchedPhotosMax;
  VEDUTA_ASSIGN_OR_RETURN(const FoundPhotos found, SearchPhotos(snapshot, all, unsure, sight));
  for (const FoundPhoto& photo : found.photos) {
    if (const auto position = PositionOf(photo)) Widen(*position, &extent);
    const int64_t from = photo.taken_from_unix_s, to = photo.taken_to_unix_s;
    extent.taken_from_unix_s = std::min(extent.taken_from_unix_s.value_or(from), from);
    extent.taken_to_unix_s = std::max(extent.taken_to_unix_s.value_or(to), to);
  }
  return extent;
}

}  // namespace veduta
