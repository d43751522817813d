// SPDX-License-Identifier: Apache-2.0
// Cameras and images: the records that say what there is.
#include <algorithm>
#include <utility>

#include "engine/repair/healing.h"

namespace veduta {
namespace {

bool RecoverCamera(CameraId id, HealingWork* healing) {
  const auto told = healing->told_cameras.find(id);
  if (told == healing->told_cameras.end()) return false;
  healing->cameras[id] = told->second;
  healing->cameras[id].source = "the journal, by repair";
  return true;
}

// Where RocksDB's list of files is lost, an older record may have come back, from before its focal
// length was refined; the journal has the last one.
void TakeNewerLens(CameraId id, HealingWork* healing) {
  const auto told = healing->told_cameras.find(id);
  CameraRecord& camera = healing->cameras.at(id);
  if (!healing->source.is_pieced_together() || told == healing->told_cameras.end() ||
      told->second.name != camera.name ||
      (told->second.model == camera.model && told->second.refined_from == camera.refined_from)) {
    return;
  }
  healing->notes.Add(
      "camera " + std::to_string(id.value) + " has another lens than the journal says",
      "it has that of the journal");
  camera.model = told->second.model;
  camera.refined_from = told->second.refined_from;
  camera.is_refinable = told->second.is_refinable;
  camera.focal_stddev_share = 0;  // which the journal does not tell
}

bool SameDescriptors(const Result<Features>& stored, const Features& features) {
  return stored.ok() && stored->keypoints == features.keypoints &&
         stored->descriptors == features.descriptors;
}

// What is known of images whose record cannot be read.
struct Remains {
  std::map<ImageId, PhotoName> names;
  std::map<ImageId, ContentHash> photos;

  // Empty where nothing tells it.
  PhotoName NameOf(ImageId id) const {
    const auto found = names.find(id);
    return found == names.end() ? PhotoName() : found->second;
  }
};

Remains ReadRemains(const Salvage& source) {
  Remains remains;
  source.ScanNames([&](const PhotoName& name, ImageId id) { remains.names[id] = name; })
      .IgnoreBecause("what cannot be read is recovered in another way, or named as lost");
  source.ScanHashes([&](const ContentHash& photo, ImageId id) { remains.photos[id] = photo; })
      .IgnoreBecause("what cannot be read is recovered in another way, or named as lost");
  return remains;
}

// The cameras that may have taken the photo, each with the features that it leads to. Where those
// that are stored are among them, those cameras alone: extraction is deterministic. There may be
// several then: cameras that differ by how they were refined lead to the same features.
struct Fitting {
  std::vector<std::pair<const CameraRecord*, PreparedPhoto>> cameras;
  bool has_stored_features = false;

  bool IsTold() const { return has_stored_features || cameras.size() == 1; }
};

Result<Fitting> FittingCameras(const std::vector<uint8_t>& bytes, const Result<Features>& stored,
                               const HealingWork& healing) {
  Fitting fitting, same;
  for (const auto& [id, camera] : healing.cameras) {
    PreparedPhoto photo = healing.preparer.Extract({"", "", bytes}, camera.extraction_model());
    VEDUTA_RETURN_IF_ERROR(photo.failure);
    if (photo.reason != Reason::kNone) continue;
    same.has_stored_features = same.has_stored_features || SameDescriptors(stored, photo.features);
    Fitting& of = SameDescriptors(stored, photo.features) ? same : fitting;
    of.cameras.push_back({&camera, std::move(photo)});
  }
  return same.has_stored_features ? std::move(same) : std::move(fitting);
}

// The one of them that other images have whose poses are in the same reconstruction, whose
// structure rests on its lens; the first where that does not tell.
Result<size_t> ChooseCamera(const Fitting& fitting, const std::optional<PoseRecord>& pose,
                            const HealingWork& healing) {
  if (!pose || fitting.cameras.size() == 1) return size_t{0};
  for (const auto& [id, image] : healing.images) {
    const auto at = std::ranges::find_if(
        fitting.cameras, [&](const auto& entry) { return entry.first->id == image.camera; });
    if (at == fitting.cameras.end()) continue;
    const Result<std::optional<PoseRecord>> other = healing.from().FindPose(id);
    if (!other.ok() && !IsDamage(other.status())) return other.status();
    if (other.ok() && *other && (*other)->reconstruction == pose->reconstruction)
      return static_cast<size_t>(at - fitting.cameras.begin());
  }
  return size_t{0};
}

// What the photo tells of itself, and what it came with.
Status FillFromPhoto(const std::vector<uint8_t>& bytes, const HealingWork& healing,
                     ImageRecord* record) {
  const PhotoExamination examined = healing.preparer.decoder().Examine(bytes);
  record->gps = examined.gps;
  record->taken = examined.taken;
  record->media_type = MediaTypeOf(examined.header.format);
  record->size_bytes = bytes.size();
  const ContributingReader& contributing = healing.from().contributing();
  const auto is_its_own = [&](const ContributedPhoto& photo) {
    if (photo.image == record->id && photo.fate == ContributionFate::kStored)
      record->contribution = photo.contribution;
    return record->contribution == 0;
  };
  Status read;
  const Status scanned = contributing.ScanContributions(1, [&](const ContributionRecord& of_all) {
    read = contributing.ScanContributedPhotos(of_all.number, 0, is_its_own);
    return read.ok() && record->contribution == 0;
  });
  if (!scanned.ok() && !IsDamage(scanned)) return scanned;
  return read.ok() || IsDamage(read) ? Status::Ok() : read;
}

// Why the image is where it is, as the journal has it.
void FillFromJournal(const HealingWork& healing, bool has_pose, ImageRecord* record) {
  record->verdict = has_pose ? Verdict::kPlaced : Verdict::kPostponed;
  record->reason = has_pose ? Reason::kRegistered : Reason::kNoVerifiedNeighbor;
  record->contributor = "veduta";
  const auto told = healing.told.images.find(record->id);
  if (told != healing.told.images.end()) {
    record->contributor = told->second.contributor;
    record->detail = told->second.detail;
    if (has_pose && told->second.propagated) record->reason = Reason::kPropagated;
  }
  const auto entry = healing.added.find(record->id);
  if (entry != healing.added.end()) record->time_unix_s = entry->second.time_unix_s;
}

// What the image was called, and who called it so; where that is not known, who sent it stays.
void FillName(const Remains& remains, ImageRecord* record) {
  const auto found = remains.names.find(record->id);
  if (found == remains.names.end()) {
    record->name = "recovered/" + record->photo.Hex().substr(0, 16);
    return;
  }
  record->name = found->second.name;
  if (!found->second.contributor.empty()) record->contributor = found->second.contributor;
}

// The record anew from the photo, where its name, its camera and its photo are known.
Status RecoverImage(ImageId id, const Remains& remains, const std::string& damage,
                    HealingWork* healing) {
  const auto photo = remains.photos.find(id);
  if (photo == remains.photos.end()) {
    const PhotoName name = remains.NameOf(id);
    healing->notes.Add(damage, name.name.empty()
                                   ? "nothing else names it; it may have been a rejected photo"
                                   : "it was the rejected photo '" + name.name + "'");
    healing->StandIn(id, name);
    return Status::Ok();
  }
  ImageRecord record;
  record.id = id;
  record.photo = photo->second;
  const Result<std::optional<PoseRecord>> pose = healing->from().FindPose(id);
  if (!pose.ok() && !IsDamage(pose.status())) return pose.status();
  const std::optional<PoseRecord> its_pose = pose.ok() ? *pose : std::optional<PoseRecord>();
  FillFromJournal(*healing, its_pose.has_value(), &record);
  FillName(remains, &record);
  const Result<std::vector<uint8_t>> bytes = healing->source.GetPhoto(record.photo);
  if (!bytes.ok()) {
    if (!IsDamage(bytes.status())) return bytes.status();
    healing->notes.Add(damage, "its photo cannot be read either");
    healing->notes.lost.push_back(record.name);
    healing->StandIn(id, {record.name, record.contributor});
    return Status::Ok();
  }
  const Result<Features> stored = healing->from().GetFeatures(record.photo);
  if (!stored.ok() && !IsDamage(stored.status())) return stored.status();
  VEDUTA_ASSIGN_OR_RETURN(const Fitting fitting, FittingCameras(*bytes, stored, *healing));
  if (!fitting.IsTold()) {
    healing->notes.Add(damage, "its camera cannot be told, so the photo is written to a folder");
    healing->notes.loose.push_back({record.name, record.photo, "", record.contributor});
    healing->StandIn(id, {record.name, record.contributor});
    return Status::Ok();
  }
  VEDUTA_ASSIGN_OR_RETURN(const size_t chosen, ChooseCamera(fitting, its_pose, *healing));
  const auto& [camera, prepared] = fitting.cameras[chosen];
  record.camera = camera->id;
  record.width_px = prepared.width_px;
  record.height_px = prepared.height_px;
  record.orientation = prepared.orientation;
  VEDUTA_RETURN_IF_ERROR(FillFromPhoto(*bytes, *healing, &record));
  record.feature_count = static_cast<uint32_t>(prepared.features.size());
  healing->notes.Add(damage, "the record of photo '" + record.name + "' is made again");
  healing->images[id] = std::move(record);
  return Status::Ok();
}

// Photos that no record and no index knows. Those in files alone are searched for where records of
// images are lost; those under a mark count where their commits may be lost.
std::set<ContentHash> FindStrays(const Remains& remains, bool lost_records,
                                 const HealingWork& healing) {
  std::set<ContentHash> known, strays;
  for (const auto& [id, image] : healing.images) known.insert(image.photo);
  for (const auto& [id, photo] : remains.photos) known.insert(photo);
  const auto collect = [&](const ContentHash& photo) {
    const Result<bool> is_ahead = healing.from().IsWrittenAhead(photo);
    const bool counts =
        is_ahead.ok() && *is_ahead ? healing.source.may_miss_commits() : lost_records;
    if (counts && !known.contains(photo)) strays.insert(photo);
    return true;
  };
  healing.from().ScanPhotoKeys(collect).IgnoreBecause("photos are searched for in files, too");
  if (lost_records) healing.source.ScanStrayPhotos(collect);
  return strays;
}

// What its mark calls it, unless another is called so: then the photo was refused, or sent anew.
PhotoName NameOfStray(const ContentHash& photo, const HealingWork& healing) {
  const Result<std::optional<PhotoName>> ahead = healing.from().FindNameAhead(photo);
  const auto has_it = [&](const auto& other) {
    return other.name == (*ahead)->name && other.contributor == (*ahead)->contributor;
  };
  using Entry = std::pair<const ImageId, ImageRecord>;
  if (ahead.ok() && *ahead && std::ranges::none_of(healing.images, has_it, &Entry::second) &&
      std::ranges::none_of(healing.notes.loose, has_it))
    return **ahead;
  return {"recovered/" + photo.Hex().substr(0, 16), "veduta"};
}

// They are added anew, or written to a folder where nobody can tell which camera took them.
Status RecoverStrays(const std::set<ContentHash>& strays, HealingWork* healing) {
  for (const ContentHash& photo : strays) {
    const Result<std::vector<uint8_t>> bytes = healing->source.GetPhoto(photo);
    if (!bytes.ok() && !IsDamage(bytes.status())) return bytes.status();
    if (!bytes.ok()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const Fitting fitting,
                            FittingCameras(*bytes, healing->from().GetFeatures(photo), *healing));
    const PhotoName name = NameOfStray(photo, *healing);
    healing->notes.Add("a photo belongs to no image, while records are lost",
                       fitting.IsTold() ? "it is added again as '" + name.name + "'"
                                        : "it is written to a folder as '" + name.name + "'");
    healing->notes.loose.push_back({name.name, photo,
                                    fitting.IsTold() ? fitting.cameras.front().first->name : "",
                                    name.contributor});
  }
  return Status::Ok();
}

}  // namespace

Status HealCameras(HealingWork* healing) {
  const auto read = [&](CameraId id) -> Result<bool> {
    const Result<CameraRecord> camera = healing->from().GetCamera(id);
    if (camera.ok()) {
      healing->cameras[id] = *camera;
      TakeNewerLens(id, healing);
      return true;
    }
    if (!IsDamage(camera.status())) return camera.status();
    const bool is_missing = camera.status().code() == StatusCode::kNotFound;
    const bool recovered = RecoverCamera(id, healing);
    if (is_missing && id.value >= healing->state.next_camera && !recovered) return false;
    healing->notes.Add(
        "camera " + std::to_string(id.value) + " cannot be read: " + camera.status().message(),
        recovered ? "it is taken from the journal"
                  : "its photos are written to a folder: add them again with their camera");
    return true;
  };
  VEDUTA_RETURN_IF_ERROR(VisitIds<CameraId>(*healing, healing->state.next_camera, read));
  for (const auto& [id, camera] : healing->cameras) {
    VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
        [&camera = camera](Transaction& transaction) { transaction.PutCamera(camera); }));
  }
  return Status::Ok();
}

Status HealImages(HealingWork* healing) {
  std::map<ImageId, std::string> lost;
  const auto read = [&](ImageId id) -> Result<bool> {
    const Result<ImageRecord> image = healing->from().GetImage(id);
    if (image.ok()) {
      healing->images[id] = *image;
      return true;
    }
    if (!IsDamage(image.status())) return image.status();
    const bool is_missing = image.status().code() == StatusCode::kNotFound;
    if (is_missing && healing->told.removed.contains(id)) return true;
    if (is_missing && id.value >= healing->state.next_image) return false;
    lost[id] = "the record of image " + std::to_string(id.value) +
               " cannot be read: " + image.status().message();
    return true;
  };
  VEDUTA_RETURN_IF_ERROR(VisitIds<ImageId>(*healing, healing->state.next_image, read));
  const bool is_pieced_together = healing->source.is_pieced_together();
  const bool may_miss_commits = healing->source.may_miss_commits();
  if (lost.empty() && !healing->state_is_lost && !may_miss_commits) return Status::Ok();
  const Remains remains = ReadRemains(healing->source);
  // Images of which nothing is left but an entry of an index.
  for (const auto& [id, photo] : remains.photos) {
    if (!healing->images.contains(id) && !lost.contains(id))
      lost[id] = "the record of image " + std::to_string(id.value) + " is missing";
  }
  // Numbers have no gaps, also where nothing tells of an image any more.
  const uint32_t last =
      std::max(healing->images.empty() ? 0 : healing->images.rbegin()->first.value,
               lost.empty() ? 0 : lost.rbegin()->first.value);
  for (ImageId id(1); id.value < last; ++id.value) {
    const bool is_known = healing->images.contains(id) || healing->told.removed.contains(id);
    if (!is_known && !lost.contains(id))
      lost[id] = "the record of image " + std::to_string(id.value) + " is missing";
  }
  for (const auto& [id, damage] : lost)
    VEDUTA_RETURN_IF_ERROR(RecoverImage(id, remains, damage, healing));
  // Files may still have photos that somebody has removed: those are not recovered.
  const bool lost_records =
      (!lost.empty() || is_pieced_together) && !healing->state.removed_bytes_left;
  return RecoverStrays(FindStrays(remains, lost_records, *healing), healing);
}

}  // namespace veduta
