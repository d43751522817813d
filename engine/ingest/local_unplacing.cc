// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/local_unplacing.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string_view>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/journal.h"

namespace veduta {
namespace {

// A reconstruction is of three images at least.
constexpr uint32_t kImagesMin = 3;

// The images that see a point together with this one.
std::set<ImageId> ImagesAround(const CityMap& map, ImageId image) {
  std::set<ImageId> around;
  for (const PointId point : map.PointsSeenBy({&image, 1})) {
    for (const TrackElement& element : map.point(point).track) around.insert(element.image);
  }
  around.erase(image);
  return around;
}

// Takes poses one after another.
class Unplacer final {
 public:
  Unplacer(uint32_t observations_min, MapLoader* loader, CityMap* map)
      : observations_min_(observations_min), loader_(*loader), map_(*map) {}

  Status Unplace(ImageId image) {
    VEDUTA_RETURN_IF_ERROR(loader_.LoadToUnplace(image));
    const std::set<ImageId> around = ImagesAround(map_, image);
    map_.UnplaceImage(image);
    shaken_.erase(image);
    shaken_.insert(around.begin(), around.end());
    unplaced_.insert(image);
    return Status::Ok();
  }

  // The first of those around that sees too little now.
  std::optional<ImageId> FindDependent() const {
    for (const ImageId id : shaken_) {
      if (CountObservations(map_.image(id)) < observations_min_) return id;
    }
    return std::nullopt;
  }

  const std::set<ImageId>& unplaced() const { return unplaced_; }

 private:
  const uint32_t observations_min_;
  MapLoader& loader_;
  CityMap& map_;
  std::set<ImageId> shaken_, unplaced_;
};

// Whether the entry tells of what a person has done to the map.
bool IsOfPerson(const JournalRecord& entry) {
  static constexpr std::string_view kByPeople[] = {"add",    "allow",  "forbid", "import",
                                                   "remove", "repair", "replace"};
  return std::ranges::find(kByPeople, entry.action) != std::end(kByPeople);
}

// Entries of the journal that are read at once: it can be read forwards alone.
constexpr uint64_t kEntriesAtOnce = 64;

// Reads the journal backwards over the steps that followed by themselves, and over what does not
// touch the map, up to what a person did; so many photos that were added are passed over.
Status ScanWhatFollowed(const Snapshot& base, uint64_t next_journal, uint32_t photos,
                        const std::function<void(const JournalRecord&)>& read) {
  std::vector<JournalRecord> entries;
  for (uint64_t end = next_journal; end > 1;) {
    const uint64_t begin = end > kEntriesAtOnce ? end - kEntriesAtOnce : 1;
    entries.clear();
    VEDUTA_RETURN_IF_ERROR(base.ScanJournal(begin, [&](const JournalRecord& entry) {
      if (entry.sequence < end) entries.push_back(entry);
      return entry.sequence + 1 < end;
    }));
    for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
      if (IsOfPerson(*entry)) {
        if (entry->action != "add" || photos == 0) return Status::Ok();
        --photos;
      }
      read(*entry);
    }
    end = begin;
  }
  return Status::Ok();
}

}  // namespace

uint32_t CountObservations(const MapImage& image) {
  return static_cast<uint32_t>(
      std::ranges::count_if(image.points, [](PointId point) { return point.valid(); }));
}

Result<std::vector<ImageId>> UnplaceWithDependents(std::span<const ImageId> images,
                                                   uint32_t observations_min, MapLoader* loader,
                                                   CityMap* map) {
  VEDUTA_CHECK(!images.empty(), "no image is to lose its pose");
  VEDUTA_RETURN_IF_ERROR(loader->LoadToUnplace(images.front()));
  const ReconstructionId reconstruction = map->image(images.front()).reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          loader->GetReconstruction(reconstruction));
  Unplacer unplacer(observations_min, loader, map);
  for (const ImageId image : images) VEDUTA_RETURN_IF_ERROR(unplacer.Unplace(image));
  while (const std::optional<ImageId> next = unplacer.FindDependent())
    VEDUTA_RETURN_IF_ERROR(unplacer.Unplace(*next));
  const size_t left = record.image_count - unplacer.unplaced().size();
  if (left > 0 && left < kImagesMin) {
    std::vector<ImageId> members;
    VEDUTA_RETURN_IF_ERROR(loader->snapshot().ScanPoses([&](const PoseRecord& pose) {
      const bool is_left =
          pose.reconstruction == reconstruction && !unplacer.unplaced().contains(pose.image);
      if (is_left) members.push_back(pose.image);
      return members.size() < left;
    }));
    for (const ImageId id : members) VEDUTA_RETURN_IF_ERROR(unplacer.Unplace(id));
  }
  std::set<ImageId> others = unplacer.unplaced();
  for (const ImageId image : images) others.erase(image);
  return std::vector<ImageId>(others.begin(), others.end());
}

Status WriteChangedLocally(const CityMap& map, const Snapshot& snapshot, Transaction* transaction) {
  std::set<ReconstructionId> changed;
  for (const auto& [image, reconstruction] : map.changes().unplaced) changed.insert(reconstruction);
  for (const auto& [reconstruction, change] : map.changes().counts) changed.insert(reconstruction);
  std::map<ReconstructionId, ReconstructionRecord> records;
  for (const ReconstructionId id : changed) {
    VEDUTA_ASSIGN_OR_RETURN(records[id], snapshot.GetReconstruction(id));
    ++records[id].geometry_version;
  }
  for (const auto& [image, reconstruction] : map.changes().unplaced) {
    ReconstructionRecord& record = records[reconstruction];
    --record.image_count;
    transaction->DeletePose(image);
    PointBlock none;
    none.home = image;
    transaction->PutPointBlock(reconstruction, record.points_generation, none);
  }
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(snapshot));
  for (auto& [id, record] : records) {
    if (const auto change = map.changes().counts.find(id); change != map.changes().counts.end()) {
      record.point_count += change->second.points;
      record.observation_count += change->second.observations;
      record.reprojection_error_px_sum += change->second.reprojection_error_px_sum;
    }
    // The adjustment of the whole is due, or that of the submaps that see something less.
    if (!submaps.IsParted(id)) record.images_at_adjustment = 0;
    record.is_dissolved = record.image_count == 0;
    if (record.is_dissolved) record.georeference = Georeference();
    transaction->PutReconstruction(record);
  }
  VEDUTA_RETURN_IF_ERROR(submaps.Follow(map, snapshot));
  submaps.MakeDue(
      std::vector(map.changes().observations.begin(), map.changes().observations.end()));
  submaps.Write(transaction);
  WritePosesAndObservations(map, transaction);
  for (const ImageId home : map.changes().blocks) {
    const auto record = records.find(map.image(home).reconstruction);
    VEDUTA_CHECK(record != records.end(), "a point of another reconstruction has changed");
    transaction->PutPointBlock(record->first, record->second.points_generation,
                               map.StoredBlock(home));
  }
  return Status::Ok();
}

Result<std::set<ImageId>> AlreadyDoubted(const Snapshot& base, uint64_t next_journal,
                                         uint32_t photos) {
  std::set<ImageId> doubted;
  const auto note = [&](const JournalRecord& entry) {
    if (entry.action == "doubt") doubted.insert(entry.image);
  };
  VEDUTA_RETURN_IF_ERROR(ScanWhatFollowed(base, next_journal, photos, note));
  return doubted;
}

Result<std::vector<ReconstructionId>> ListSplitOff(const Snapshot& base, uint64_t next_journal,
                                                   uint32_t photos) {
  std::vector<ReconstructionId> parts;
  const auto note = [&](const JournalRecord& entry) {
    if (entry.action == "split") parts.push_back(entry.reconstruction);
  };
  VEDUTA_RETURN_IF_ERROR(ScanWhatFollowed(base, next_journal, photos, note));
  return parts;
}

Result<size_t> CountMergedInto(const Snapshot& base, std::span<const ReconstructionId> parts,
                               ReconstructionId into) {
  size_t count = 0;
  for (ReconstructionId part : parts) {
    do {
      VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, base.GetReconstruction(part));
      part = record.merged_into;
    } while (part.valid() && part != into);
    if (part.valid()) ++count;
  }
  return count;
}

Status PostponeImages(const Snapshot& snapshot, std::span<const ImageId> images,
                      ReconstructionId from, const std::string& detail, DatabaseState* state,
                      Transaction* transaction) {
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord image, snapshot.GetImage(id));
    image.verdict = Verdict::kPostponed;
    image.reason = Reason::kDoubted;
    image.detail = detail;
    transaction->PutImage(image);
    AppendJournal({0, 0, "veduta", "doubt", id, from, detail}, state, transaction);
    std::vector<ImageId>& retries = state->pending_propagation;
    if (std::ranges::find(retries, id) == retries.end()) retries.push_back(id);
  }
  return Status::Ok();
}

}  // namespace veduta
