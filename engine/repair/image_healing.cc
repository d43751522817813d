// SPDX-License-Identifier: Apache-2.0
// Journal, cameras and images: the records that say what there is.
#include <algorithm>

#include "engine/engine.h"
#include "engine/repair/healing.h"

namespace veduta {
namespace {

// Reads the journal from `first` up to the first entry that cannot be read, and says which one
// comes next.
uint64_t ReadEntries(const Snapshot& from, uint64_t first, std::map<uint64_t, JournalRecord>* all) {
  uint64_t next = first;
  const Status read = from.ScanJournal(first, [&](const JournalRecord& entry) {
    (*all)[entry.sequence] = entry;
    next = entry.sequence + 1;
    return true;
  });
  return read.ok() ? UINT64_MAX : next;
}

void Remember(const JournalRecord& entry, Healing* healing) {
  if (entry.action == "camera") healing->camera_entries.push_back(entry);
  if (entry.action == "add" && entry.image.valid()) healing->added.insert({entry.image, entry});
}

JournalRecord LostEntry(uint64_t sequence) {
  JournalRecord entry;
  entry.sequence = sequence;
  entry.actor = "veduta";
  entry.action = "repair";
  entry.detail = "this entry was damaged";
  return entry;
}

// The camera that the journal's entry describes: "NAME: SIZE PARAMS".
std::optional<CameraRecord> CameraFrom(const JournalRecord& entry, CameraId id) {
  const size_t params = entry.detail.rfind(' ');
  if (params == std::string::npos || params == 0) return std::nullopt;
  const size_t size = entry.detail.rfind(' ', params - 1);
  if (size == std::string::npos || size == 0 || entry.detail[size - 1] != ':') return std::nullopt;
  const Result<CameraModel> model = ParseCamera(entry.detail.substr(size + 1, params - size - 1),
                                                entry.detail.substr(params + 1));
  if (!model.ok()) return std::nullopt;
  return CameraRecord{id, entry.detail.substr(0, size - 1), *model, "the journal, by repair"};
}

// Each camera has one entry in the journal, in the order of their ids.
bool RecoverCamera(CameraId id, Healing* healing) {
  if (id.value > healing->camera_entries.size()) return false;
  const auto camera = CameraFrom(healing->camera_entries[id.value - 1], id);
  if (camera) healing->cameras[id] = *camera;
  return camera.has_value();
}

bool SameDescriptors(const Result<Features>& stored, const Features& features) {
  return stored.ok() && stored->keypoints == features.keypoints &&
         stored->descriptors == features.descriptors;
}

// What is known of images whose record cannot be read.
struct Remains {
  std::map<ImageId, std::string> names;
  std::map<ImageId, ContentHash> photos;
};

Remains ReadRemains(const Salvage& source) {
  Remains remains;
  source.ScanNames([&](std::string_view name, ImageId id) { remains.names[id] = name; })
      .IgnoreBecause("what cannot be read is recovered in another way, or named as lost");
  source.ScanHashes([&](const ContentHash& photo, ImageId id) { remains.photos[id] = photo; })
      .IgnoreBecause("what cannot be read is recovered in another way, or named as lost");
  return remains;
}

// The cameras that may have taken the photo, each with the features that it leads to. Where those
// that are stored are among them, that camera alone: extraction is deterministic.
std::vector<std::pair<const CameraRecord*, PreparedPhoto>> FittingCameras(
    const std::vector<uint8_t>& bytes, const Result<Features>& stored, const Healing& healing) {
  std::vector<std::pair<const CameraRecord*, PreparedPhoto>> fitting;
  for (const auto& [id, camera] : healing.cameras) {
    PreparedPhoto photo = healing.preparer.Extract({"", "", bytes}, camera.model);
    if (photo.reason != Reason::kNone) continue;
    if (SameDescriptors(stored, photo.features)) {
      fitting.clear();
      fitting.push_back({&camera, std::move(photo)});
      return fitting;
    }
    fitting.push_back({&camera, std::move(photo)});
  }
  return fitting;
}

void FillFromJournal(const Healing& healing, ImageRecord* record) {
  const auto entry = healing.added.find(record->id);
  record->contributor = entry == healing.added.end() ? "veduta" : entry->second.actor;
  if (entry == healing.added.end()) return;
  record->time_unix_s = entry->second.time_unix_s;
  record->detail = entry->second.detail;
}

std::string NameFor(const Remains& remains, ImageId id, const ContentHash& photo) {
  const auto name = remains.names.find(id);
  return name == remains.names.end() ? "recovered/" + photo.Hex().substr(0, 16) : name->second;
}

// The record anew from the photo, where its name, its camera and its photo are known.
Status RecoverImage(ImageId id, const Remains& remains, const std::string& damage,
                    Healing* healing) {
  const auto photo = remains.photos.find(id);
  if (photo == remains.photos.end()) {
    const auto name = remains.names.find(id);
    healing->notes.Add(damage, name == remains.names.end()
                                   ? "nothing else names it; it may have been a rejected photo"
                                   : "it was the rejected photo '" + name->second + "'");
    return Status::Ok();
  }
  ImageRecord record;
  record.id = id;
  record.photo = photo->second;
  record.name = NameFor(remains, id, record.photo);
  FillFromJournal(*healing, &record);
  const Result<std::vector<uint8_t>> bytes = healing->source.GetPhoto(record.photo);
  if (!bytes.ok()) {
    if (!IsDamage(bytes.status())) return bytes.status();
    healing->notes.Add(damage, "its photo cannot be read either");
    healing->notes.lost.push_back(record.name);
    return Status::Ok();
  }
  const Result<Features> stored = healing->from().GetFeatures(record.photo);
  const auto fitting = FittingCameras(*bytes, stored, *healing);
  if (fitting.size() != 1) {
    healing->notes.Add(damage, "its camera cannot be told, so the photo is written to a folder");
    healing->notes.loose.push_back({record.name, record.photo, "", record.contributor});
    return Status::Ok();
  }
  const PreparedPhoto& prepared = fitting.front().second;
  record.camera = fitting.front().first->id;
  record.width_px = prepared.width_px;
  record.height_px = prepared.height_px;
  record.size_bytes = bytes->size();
  record.feature_count = static_cast<uint32_t>(prepared.features.size());
  const Result<std::optional<PoseRecord>> pose = healing->from().FindPose(id);
  const bool placed = pose.ok() && pose->has_value();
  record.verdict = placed ? Verdict::kPlaced : Verdict::kPostponed;
  record.reason = placed ? Reason::kRegistered : Reason::kNoVerifiedNeighbor;
  healing->notes.Add(damage, "the record of photo '" + record.name + "' is made again");
  healing->images[id] = std::move(record);
  return Status::Ok();
}

// Photos that no record and no index knows, while records are lost. They are added anew.
Status RecoverStrays(const Remains& remains, Healing* healing) {
  std::set<ContentHash> known, strays;
  for (const auto& [id, image] : healing->images) known.insert(image.photo);
  for (const auto& [id, photo] : remains.photos) known.insert(photo);
  const auto collect = [&](const ContentHash& photo) {
    if (!known.contains(photo)) strays.insert(photo);
    return true;
  };
  healing->from().ScanPhotoKeys(collect).IgnoreBecause("photos are searched for in files, too");
  healing->source.ScanStrayPhotos(collect);
  for (const ContentHash& photo : strays) {
    const Result<bool> is_coming = healing->from().IsWrittenAhead(photo);
    const Result<std::vector<uint8_t>> bytes = healing->source.GetPhoto(photo);
    if ((is_coming.ok() && *is_coming) || !bytes.ok()) continue;
    const auto fitting = FittingCameras(*bytes, healing->from().GetFeatures(photo), *healing);
    const std::string name = "recovered/" + photo.Hex().substr(0, 16);
    healing->notes.Add("a photo belongs to no image, while records of images are lost",
                       fitting.size() == 1 ? "it is added again as '" + name + "'"
                                           : "it is written to a folder as '" + name + "'");
    healing->notes.loose.push_back(
        {name, photo, fitting.size() == 1 ? fitting.front().first->name : "", "veduta"});
  }
  return Status::Ok();
}

}  // namespace

Status HealJournal(Healing* healing) {
  std::map<uint64_t, JournalRecord> all;
  for (uint64_t next = 1; next != UINT64_MAX;) {
    const uint64_t after = ReadEntries(healing->from(), next, &all);
    next = after == next ? next + 1 : after;
    const uint64_t end = std::max<uint64_t>(healing->state.next_journal,
                                            (all.empty() ? 0 : all.rbegin()->first) + kMissesMax);
    if (next >= end) break;
  }
  if (!all.empty())
    healing->state.next_journal = std::max(healing->state.next_journal, all.rbegin()->first + 1);
  uint64_t lost = 0;
  for (uint64_t sequence = 1; sequence < healing->state.next_journal; ++sequence) {
    const auto found = all.find(sequence);
    if (found == all.end()) ++lost;
    const JournalRecord entry = found == all.end() ? LostEntry(sequence) : found->second;
    Remember(entry, healing);
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.AddJournal(entry); }));
  }
  if (lost > 0) {
    healing->notes.Add(std::to_string(lost) + " entries of the journal cannot be read",
                       "entries that say so stand in their place");
  }
  return Status::Ok();
}

Status HealCameras(Healing* healing) {
  const auto read = [&](CameraId id) -> Result<bool> {
    const Result<CameraRecord> camera = healing->from().GetCamera(id);
    if (camera.ok()) {
      healing->cameras[id] = *camera;
      return true;
    }
    if (!IsDamage(camera.status())) return camera.status();
    const bool is_missing = camera.status().code() == StatusCode::kNotFound;
    if (is_missing && id.value >= healing->state.next_camera && !RecoverCamera(id, healing))
      return false;
    const bool recovered = RecoverCamera(id, healing);
    healing->notes.Add(
        "camera " + std::to_string(id.value) + " cannot be read: " + camera.status().message(),
        recovered ? "it is taken from the journal"
                  : "its photos are written to a folder: add them again with their camera");
    return true;
  };
  VEDUTA_RETURN_IF_ERROR(VisitIds<CameraId>(*healing, healing->state.next_camera, read));
  for (const auto& [id, camera] : healing->cameras) {
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.PutCamera(camera); }));
  }
  return Status::Ok();
}

Status HealImages(Healing* healing) {
  std::map<ImageId, std::string> lost;
  const auto read = [&](ImageId id) -> Result<bool> {
    const Result<ImageRecord> image = healing->from().GetImage(id);
    if (image.ok()) {
      healing->images[id] = *image;
      return true;
    }
    if (!IsDamage(image.status())) return image.status();
    if (image.status().code() == StatusCode::kNotFound && id.value >= healing->state.next_image)
      return false;
    lost[id] = "the record of image " + std::to_string(id.value) +
               " cannot be read: " + image.status().message();
    return true;
  };
  VEDUTA_RETURN_IF_ERROR(VisitIds<ImageId>(*healing, healing->state.next_image, read));
  if (lost.empty() && !healing->state_is_lost && !healing->source.is_pieced_together())
    return Status::Ok();
  const Remains remains = ReadRemains(healing->source);
  // Images of which nothing is left but an entry of an index.
  for (const auto& [id, photo] : remains.photos) {
    if (!healing->images.contains(id) && !lost.contains(id))
      lost[id] = "the record of image " + std::to_string(id.value) + " is missing";
  }
  for (const auto& [id, damage] : lost)
    VEDUTA_RETURN_IF_ERROR(RecoverImage(id, remains, damage, healing));
  if (lost.empty() && !healing->source.is_pieced_together()) return Status::Ok();
  return RecoverStrays(remains, healing);
}

}  // namespace veduta
