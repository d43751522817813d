// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/submap_steps.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "engine/ingest/due_work.h"
#include "engine/ingest/healing_writer.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/region_writer.h"
#include "engine/ingest/submap_borders.h"
#include "engine/ingest/submap_groups.h"
#include "engine/journal/journal.h"
#include "engine/mapping/view_graph_parts.h"

namespace veduta {
namespace {

Result<std::vector<std::vector<ImageId>>> FindParts(const Snapshot& snapshot,
                                                    std::span<const ImageId> images,
                                                    const AdjustmentSchedule& schedule) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ViewGraphEdge> edges, ListEdges(snapshot, images));
  return PartViewGraph(images, edges, schedule.submap_images_max);
}

// The submap beside this one that most matches lead to, if there is room for both in one.
Result<std::optional<SubmapId>> FindBeside(const Snapshot& snapshot, const Submaps& submaps,
                                           const SubmapRecord& submap,
                                           const AdjustmentSchedule& schedule) {
  VEDUTA_ASSIGN_OR_RETURN(auto weights, WeighBeside(snapshot, submaps, submap));
  std::erase_if(weights, [&](const auto& entry) {
    const size_t together = submaps.Find(entry.first)->images.size() + submap.images.size();
    const bool moves_alike =
        submaps.Find(entry.first)->motion.has_value() == submap.motion.has_value();
    return together > schedule.submap_images_max || !moves_alike;
  });
  const auto heaviest = std::ranges::max_element(
      weights, {}, [](const std::pair<const SubmapId, uint64_t>& entry) { return entry.second; });
  return heaviest == weights.end() ? std::nullopt : std::optional(heaviest->first);
}

// Parts a submap that is too large, or joins one that is too small to another. False where its size
// is right for an adjustment, or nothing can be joined.
Result<bool> Reshape(const Snapshot& snapshot, const SubmapRecord& submap,
                     const AdjustmentSchedule& schedule, Submaps* submaps) {
  if (submap.images.size() > schedule.submap_images_max) {
    VEDUTA_ASSIGN_OR_RETURN(const auto parts, FindParts(snapshot, submap.images, schedule));
    submaps->Part(submap.reconstruction, parts);
    return true;
  }
  if (submap.images.size() >= schedule.submap_images_min) return false;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<SubmapId> beside,
                          FindBeside(snapshot, *submaps, submap, schedule));
  if (beside) submaps->Join(submap.id, *beside);
  return beside.has_value();
}

// Adjusts and heals the submaps in the map, and puts what has changed into the transaction.
Status AdjustAndWrite(const IngestParts& parts, const WriteScope& scope,
                      ReconstructionId reconstruction, const SubmapGroup& group,
                      HealingWriter* writer, Submaps* submaps) {
  parts.TrimMap();
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  const MappingContext context{&loader, parts.map, parts.pool, parts.options.mapper};
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord whole,
                          scope.base->GetReconstruction(reconstruction));
  const bool keeps_borders = KeepsBorders(whole, true, parts.options.schedule);
  VEDUTA_ASSIGN_OR_RETURN(const Region region, LoadRegion(context, group.images, keeps_borders));
  VEDUTA_ASSIGN_OR_RETURN(const Healing healing, AdjustRegion(context, region));
  VEDUTA_RETURN_IF_ERROR(WriteRegion(parts, scope, whole, region, healing, writer, submaps));
  for (const SubmapId id : group.submaps) {
    const SubmapRecord* const submap = submaps->Find(id);
    if (submap == nullptr) continue;
    // One that is too small stays due: its own step joins it to another.
    const bool is_too_small = submap->images.size() < parts.options.schedule.submap_images_min;
    if (id == group.submaps.front() || !is_too_small) submaps->NoteAdjusted(id);
    if (!keeps_borders) continue;
    VEDUTA_ASSIGN_OR_RETURN(const SubmapBorder border, FindBorder(context, *submaps, id, healing));
    scope.transaction->PutSubmapBorder(border);
  }
  return Status::Ok();
}

}  // namespace

Status PartIntoSubmaps(const Snapshot& snapshot, ReconstructionId reconstruction,
                       const AdjustmentSchedule& schedule, Submaps* submaps) {
  std::vector<ImageId> images;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction == reconstruction) images.push_back(pose.image);
    return true;
  }));
  VEDUTA_ASSIGN_OR_RETURN(const auto found, FindParts(snapshot, images, schedule));
  submaps->Part(reconstruction, found);
  return Status::Ok();
}

Status PartReconstruction(const IngestParts& parts, ReconstructionId reconstruction,
                          WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  VEDUTA_RETURN_IF_ERROR(
      PartIntoSubmaps(*scope.base, reconstruction, parts.options.schedule, &submaps));
  submaps.Write(scope.transaction.get());
  record.images_at_adjustment = record.image_count;
  scope.transaction->PutReconstruction(record);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  const std::string detail = "in " + std::to_string(submaps.List(reconstruction).size()) +
                             " submaps, " + std::to_string(record.image_count) + " images";
  AppendJournal({0, 0, "veduta", "adjust", {}, reconstruction, detail}, &state,
                scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Result<AdjustedWhole> AdjustSubmap(const IngestParts& parts, ReconstructionId reconstruction,
                                   SubmapId submap, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  const SubmapRecord* const found = submaps.Find(submap);
  if (found == nullptr)
    return Status::NotFound("there is no submap " + std::to_string(submap.value));
  const SubmapRecord record = *found;
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const bool is_reshaped,
                          Reshape(*scope.base, record, parts.options.schedule, &submaps));
  // Lives until the commit has come, for it holds what is written ahead.
  HealingWriter writer(parts, scope, reconstruction, &state);
  if (!is_reshaped) {
    VEDUTA_ASSIGN_OR_RETURN(
        const SubmapGroup group,
        FindGroup(*scope.base, submaps, record, false, parts.options.schedule.region_images_max));
    VEDUTA_RETURN_IF_ERROR(AdjustAndWrite(parts, scope, reconstruction, group, &writer, &submaps));
    const std::string detail = std::to_string(group.images.size()) + " images around submap " +
                               std::to_string(submap.value);
    AppendJournal({0, 0, "veduta", "adjust", {}, reconstruction, detail}, &state, transaction);
  }
  submaps.Write(transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return writer.adjusted();
}

}  // namespace veduta
