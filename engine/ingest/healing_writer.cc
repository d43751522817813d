// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/healing_writer.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/seam.h"
#include "engine/journal/journal.h"
#include "engine/query/forbidden.h"

namespace veduta {

// What may not be merged with the whole may not be merged with its part either.
Status HealingWriter::ForbidAsOfWhole(ReconstructionId part) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> all, scope_.base->ListForbidden());
  for (ForbiddenRecord forbidden : all) {
    if (forbidden.kind != ForbiddenKind::kMerge) continue;
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId a,
                            MergedEnd(*scope_.base, ReconstructionId(forbidden.a)));
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId b,
                            MergedEnd(*scope_.base, ReconstructionId(forbidden.b)));
    if (a != from_ && b != from_) continue;
    forbidden.a = (a == from_ ? b : a).value;  // given before the part's, so it is lower
    forbidden.b = part.value;
    scope_.transaction->PutForbidden(forbidden);
  }
  return Status::Ok();
}

Status HealingWriter::SplitOff(const Healing& healing) {
  for (const std::vector<ImageId>& part : healing.parts) {
    ReconstructionRecord& record = split_off_.emplace_back();
    record.id = ReconstructionId(state_.next_reconstruction++);
    record.points_generation = 1;
    for (const ImageId id : part) {
      parts_.map->MoveImage(id, record.id, Sim3());
      parts_.map->MoveBlock(id, record.id, Sim3());
    }
    blocks_.push_back(WrittenAhead::PointBlocks(parts_.database, record.id, 1));
    VEDUTA_RETURN_IF_ERROR(
        WriteWhole(*parts_.map, parts_.database, scope_.transaction.get(), &record));
    AppendJournal({0,
                   0,
                   "veduta",
                   "split",
                   {},
                   record.id,
                   std::to_string(part.size()) + " images of reconstruction " +
                       std::to_string(from_.value) + ", whose frame it keeps"},
                  &state_, scope_.transaction.get());
    VEDUTA_RETURN_IF_ERROR(ForbidAsOfWhole(record.id));
    adjusted_.split_off.push_back(record.id);
  }
  return Status::Ok();
}

Status HealingWriter::ShareSeams(const Healing& healing) {
  std::map<ImageId, ReconstructionId> parts;  // of those that have left
  for (size_t i = 0; i < healing.parts.size(); ++i) {
    for (const ImageId id : healing.parts[i]) parts[id] = split_off_[i].id;
  }
  for (const DoubtedImage& unplaced : healing.unplaced) parts[unplaced.image] = {};
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, scope_.base->ListHypotheses());
  for (const HypothesisRecord& shared : all) {
    if (shared.a != from_ && shared.b != from_) continue;
    scope_.transaction->DeleteHypothesis(shared.a, shared.b);
    std::vector<ImageId> across;
    std::map<ReconstructionId, std::vector<ImageId>> of_part;
    for (const ImageId id : shared.images) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, scope_.base->FindPose(id));
      if (!pose) continue;
      const auto part = parts.find(id);
      if (pose->reconstruction != from_) {
        across.push_back(id);
      } else if (part == parts.end() || part->second.valid()) {
        of_part[part == parts.end() ? from_ : part->second].push_back(id);
      }
    }
    for (const auto& [id, images] : of_part) {
      HypothesisRecord seam = shared;
      GoOver({from_, Sim3(), 0, ""}, id, &seam);
      seam.images.clear();
      std::ranges::set_union(images, across, std::back_inserter(seam.images));
      std::erase_if(seam.unsure, [&](ImageId unsure) {
        return !std::ranges::binary_search(seam.images, unsure);
      });
      seam.is_due = true;
      seam.loop_images = 0;
      if (id != from_) {
        PutNewHypothesis(std::move(seam), &state_, scope_.transaction.get());
      } else {
        scope_.transaction->PutHypothesis(seam);
      }
    }
  }
  return Status::Ok();
}

Status HealingWriter::ProposeSeam(MapLoader* loader, ReconstructionId own, ReconstructionId other) {
  const CityMap& map = *parts_.map;
  const auto own_of = [&](std::span<const ImageId> images) {
    std::vector<ImageId> found;
    for (const ImageId id : images) {
      if (map.image(id).reconstruction == own) found.push_back(id);
    }
    return found;
  };
  std::vector<ImageId> all;
  for (const auto& [id, image] : map.images()) all.push_back(id);
  const std::vector<ImageId> part = own_of(all);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SeamPair> pairs,
                          ListSeamPairs(loader, map, part.front(), {}, part, other));
  if (pairs.empty()) return Status::Ok();
  // Judged from where later judgments start (judging.h), so that the votes can be compared.
  const std::vector<ImageId> images = SeamImages(pairs), near = own_of(images);
  VEDUTA_ASSIGN_OR_RETURN(const SeamArea seam,
                          FindSeam(loader, map, near.front(), {}, near, other));
  const Sim3 same_frame;
  HypothesisRecord hypothesis =
      HypothesisOf(own, other, same_frame, JudgeSeam(map, seam, same_frame, parts_.options.mapper),
                   RefusalReason::kSplit);
  hypothesis.images = images;
  hypothesis.is_due = true;  // images may have stayed on the wrong side
  PutNewHypothesis(std::move(hypothesis), &state_, scope_.transaction.get());
  return Status::Ok();
}

Status HealingWriter::ProposeSeams() {
  MapLoader loader(scope_.base, parts_.features, parts_.map, parts_.pool);
  std::vector<ReconstructionId> sides = {from_};
  for (const ReconstructionRecord& part : split_off_) {
    for (const ReconstructionId side : sides)
      VEDUTA_RETURN_IF_ERROR(ProposeSeam(&loader, part.id, side));
    sides.push_back(part.id);
  }
  return Status::Ok();
}

Status HealingWriter::Postpone(const Healing& healing) {
  VEDUTA_ASSIGN_OR_RETURN(const std::set<ImageId> doubted,
                          AlreadyDoubted(*scope_.base, state_.next_journal));
  for (const DoubtedImage& unplaced : healing.unplaced) {
    const std::string detail =
        "in reconstruction " + std::to_string(from_.value) + ", " + unplaced.why;
    VEDUTA_RETURN_IF_ERROR(PostponeImages(*scope_.base, {&unplaced.image, 1}, from_, detail,
                                          &state_, scope_.transaction.get()));
    if (doubted.contains(unplaced.image)) std::erase(state_.pending_propagation, unplaced.image);
    adjusted_.unplaced.push_back({unplaced.image, detail});
  }
  return Status::Ok();
}

Status HealingWriter::RemoveOutdatedDense(const Healing& healing,
                                          std::span<const ImageId> refined) {
  std::vector<ImageId> moved(refined.begin(), refined.end());
  for (const DoubtedImage& unplaced : healing.unplaced) moved.push_back(unplaced.image);
  for (const std::vector<ImageId>& part : healing.parts)
    moved.insert(moved.end(), part.begin(), part.end());
  if (moved.empty()) return Status::Ok();
  return RemoveFromDense(*scope_.base, moved, scope_.transaction.get()).status();
}

}  // namespace veduta
