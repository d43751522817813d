// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/region_writer.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"

namespace veduta {
namespace {

// Writes what has changed of the reconstruction, from which `writer` has split off parts.
Status WriteAdjusted(const IngestParts& parts, const HealingWriter& writer,
                     ReconstructionRecord record, Transaction* transaction) {
  const CityMap& map = *parts.map;
  const auto delete_block = [&](ImageId home) {
    PointBlock none;
    none.home = home;
    transaction->PutPointBlock(record.id, record.points_generation, none);
  };
  if (const auto change = map.changes().counts.find(record.id);
      change != map.changes().counts.end()) {
    record.point_count += change->second.points;
    record.observation_count += change->second.observations;
    record.reprojection_error_px_sum += change->second.reprojection_error_px_sum;
  }
  for (const ReconstructionRecord& part : writer.split_off()) {
    record.image_count -= part.image_count;
    record.point_count -= part.point_count;
    record.observation_count -= part.observation_count;
    record.reprojection_error_px_sum -= part.reprojection_error_px_sum;
  }
  for (const auto& [image, reconstruction] : map.changes().unplaced) {
    --record.image_count;
    delete_block(image);
  }
  for (const ImageId home : map.changes().blocks) {
    if (map.image(home).reconstruction == record.id) {
      transaction->PutPointBlock(record.id, record.points_generation, map.StoredBlock(home));
    } else {
      delete_block(home);
    }
  }
  ++record.geometry_version;
  record.is_dissolved = record.image_count == 0;
  if (record.is_dissolved) record.georeference = Georeference();
  transaction->PutReconstruction(record);
  WriteUnplaced(map, transaction);
  WritePosesAndObservations(map, transaction);
  return Status::Ok();
}

// Images around the region that see fewer points than a pose needs now: only the adjustment of
// their own submap takes poses of theirs.
std::vector<ImageId> FindUnsupportedAround(const IngestParts& parts, const Region& region) {
  std::vector<ImageId> found;
  for (const ImageId id : region.known) {
    if (std::ranges::binary_search(region.images, id)) continue;
    if (CountObservations(parts.map->image(id)) < parts.options.mapper.observations_min)
      found.push_back(id);
  }
  return found;
}

constexpr size_t kImagesMin = 3;  // of a reconstruction

// What of `found` is still in the reconstruction.
Result<Healing> StillThere(const Snapshot& base, ReconstructionId reconstruction,
                           const Healing& found) {
  const auto is_there = [&](ImageId id) -> Result<bool> {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, base.FindPose(id));
    return pose && pose->reconstruction == reconstruction;
  };
  Healing left;
  for (const DoubtedImage& doubted : found.unplaced) {
    VEDUTA_ASSIGN_OR_RETURN(const bool stays, is_there(doubted.image));
    if (stays) left.unplaced.push_back(doubted);
  }
  for (const std::vector<ImageId>& part : found.parts) {
    std::vector<ImageId> of_part;
    for (const ImageId id : part) {
      VEDUTA_ASSIGN_OR_RETURN(const bool stays, is_there(id));
      if (stays) of_part.push_back(id);
    }
    if (of_part.size() >= kImagesMin) left.parts.push_back(std::move(of_part));
  }
  return left;
}

}  // namespace

Status WriteRegion(const IngestParts& parts, const WriteScope& scope, ReconstructionRecord record,
                   const Region& region, const Healing& healing, HealingWriter* writer,
                   Submaps* submaps) {
  Transaction* const transaction = scope.transaction.get();
  const ReconstructionId id = record.id;
  const bool is_dissolved = healing.unplaced.size() == record.image_count;
  VEDUTA_RETURN_IF_ERROR(writer->SplitOff(healing));
  VEDUTA_RETURN_IF_ERROR(WriteAdjusted(parts, *writer, std::move(record), transaction));
  VEDUTA_RETURN_IF_ERROR(writer->RemoveOutdatedDense(healing));
  VEDUTA_RETURN_IF_ERROR(submaps->Follow(*parts.map, *scope.base));
  submaps->MakeDue(FindUnsupportedAround(parts, region));
  VEDUTA_RETURN_IF_ERROR(writer->Postpone(healing));
  if (!healing.parts.empty()) {
    VEDUTA_RETURN_IF_ERROR(writer->ShareSeams(healing));
    return writer->ProposeSeams();
  }
  if (is_dissolved) return DropHypotheses(*scope.base, id, transaction);
  return MakeHypothesesDue(*scope.base, id, region.images, Splits::kPassedOver, transaction);
}

Status TakeOutOfRegion(const IngestParts& parts, const WriteScope& scope,
                       ReconstructionRecord record, const Healing& found, HealingWriter* writer,
                       Submaps* submaps) {
  VEDUTA_ASSIGN_OR_RETURN(Healing left, StillThere(*scope.base, record.id, found));
  if (left.empty()) {
    scope.transaction->PutReconstruction(record);
    return Status::Ok();
  }
  std::set<ImageId> images;
  for (const DoubtedImage& doubted : left.unplaced) images.insert(doubted.image);
  for (const std::vector<ImageId>& part : left.parts) images.insert(part.begin(), part.end());
  if (record.image_count < images.size() + kImagesMin) {
    for (const SubmapId id : submaps->List(record.id)) {
      for (const ImageId image : submaps->Find(id)->images) {
        if (images.insert(image).second)
          left.unplaced.push_back({image, "less than three images are left there"});
      }
    }
  }
  parts.TrimMap();
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  const MappingContext context{&loader, parts.map, parts.pool, parts.options.mapper};
  VEDUTA_ASSIGN_OR_RETURN(const Region region,
                          LoadRegion(context, std::vector(images.begin(), images.end()), true));
  const Healing healing = TakeOut(context, std::move(left));
  submaps->MakeDue(region.known);
  return WriteRegion(parts, scope, std::move(record), region, healing, writer, submaps);
}

}  // namespace veduta
