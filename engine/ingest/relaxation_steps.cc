// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/relaxation_steps.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "engine/ingest/hypotheses.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/region_writer.h"
#include "engine/ingest/submap_groups.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/journal.h"
#include "engine/mapping/similarity.h"
#include "engine/mapping/submap_relaxation.h"

namespace veduta {
namespace {

// A submap becomes due where a relaxation has moved its views of border places by more than this
// (Relaxation::change_px). It is less than the errors of features. Chosen by hand; not measured.
constexpr double kChangeMin_px = 0.25;

// What the steps read of a reconstruction.
struct Whole {
  std::vector<SubmapId> submaps;         // ascending
  std::vector<SubmapBorder> borders;     // of those that have one
  std::map<ImageId, uint32_t> place_of;  // of an image's submap in `submaps`
  std::map<ImageId, Rigid3> poses;
};

Result<Whole> ReadWhole(const Snapshot& base, const Submaps& submaps, ReconstructionId id) {
  Whole whole;
  whole.submaps = submaps.List(id);
  for (uint32_t i = 0; i < whole.submaps.size(); ++i) {
    for (const ImageId image : submaps.Find(whole.submaps[i])->images) whole.place_of[image] = i;
    VEDUTA_ASSIGN_OR_RETURN(std::optional<SubmapBorder> border,
                            base.FindSubmapBorder(whole.submaps[i]));
    if (border) whole.borders.push_back(*std::move(border));
  }
  VEDUTA_RETURN_IF_ERROR(base.ScanPoses([&](const PoseRecord& pose) {
    if (whole.place_of.contains(pose.image)) whole.poses[pose.image] = pose.cam_from_world;
    return true;
  }));
  return whole;
}

// The first image of each submap that has no border although it has been adjusted.
std::vector<ImageId> ListWithoutBorder(const Whole& whole, const Submaps& submaps) {
  std::vector<ImageId> images;
  for (const SubmapId id : whole.submaps) {
    const SubmapRecord& submap = *submaps.Find(id);
    const bool has_border = std::ranges::binary_search(whole.borders, id, {}, &SubmapBorder::id);
    if (!has_border && submap.images_at_adjustment > 0) images.push_back(submap.images.front());
  }
  return images;
}

// Two submaps, as places in Whole::submaps, ascending; or the same twice.
using Two = std::pair<uint32_t, uint32_t>;

// The submaps of a tie's views, as far as they are in the reconstruction: the first and the last.
std::optional<Two> SubmapsOf(const Whole& whole, std::span<const BorderView> tie) {
  std::optional<Two> both;
  for (const BorderView& view : tie) {
    const auto place = whole.place_of.find(view.image);
    if (place == whole.place_of.end()) continue;
    if (!both) both = {place->second, place->second};
    both = {std::min(both->first, place->second), std::max(both->second, place->second)};
  }
  return both;
}

std::optional<Two> SubmapsOf(const Whole& whole, const BorderEvidence& row) {
  const auto a = whole.place_of.find(row.a), b = whole.place_of.find(row.b);
  if (a == whole.place_of.end() || b == whole.place_of.end()) return std::nullopt;
  return Two(std::minmax(a->second, b->second));
}

// Calls visit(views) for each tie of the border.
void ForTies(const SubmapBorder& border, const auto& visit) {
  for (size_t begin = 0, end = 0; begin < border.views.size(); begin = end) {
    while (end < border.views.size() && border.views[end].tie == border.views[begin].tie) ++end;
    visit(std::span(border.views).subspan(begin, end - begin));
  }
}

// Which border counts for what lies between two submaps. Both may tell of it, and the older of the
// two does not know what has come since: the one that tells more counts, of equal ones the lower.
class Counted {
 public:
  explicit Counted(const Whole& whole) {
    for (const SubmapBorder& border : whole.borders) {
      std::map<Two, size_t> rows;
      ForTies(border, [&](std::span<const BorderView> tie) {
        if (const auto both = SubmapsOf(whole, tie)) ++rows[*both];
      });
      for (const BorderEvidence& row : border.evidence)
        if (const auto both = SubmapsOf(whole, row)) ++rows[*both];
      for (const auto& [both, count] : rows) {
        auto& [most, id] = of_[both];
        if (count > most) most = count, id = border.id;
      }
    }
  }

  bool Counts(SubmapId border, const Two& both) const {
    const auto found = of_.find(both);
    return found != of_.end() && found->second.second == border;
  }

 private:
  std::map<Two, std::pair<size_t, SubmapId>> of_;  // rows, and whose border
};

// The largest of the parts that do not agree with the largest one, or none. Fragments that stand
// for less than a reconstruction needs are left to the adjustments of their submaps.
std::vector<ImageId> FindWrongPart(const Whole& whole, const Counted& counted,
                                   const AgreementBounds& bounds) {
  constexpr size_t kImagesMin = 3;
  std::map<ImageId, ImageId> head_of;
  std::map<ImageId, std::vector<ImageId>> images_of;
  for (const SubmapBorder& border : whole.borders) {
    for (const BorderFragment& row : border.fragments) {
      const auto head = whole.place_of.find(row.head);
      const auto image = whole.place_of.find(row.image);
      if (head == whole.place_of.end() || image == whole.place_of.end()) continue;
      if (head_of.try_emplace(row.image, row.head).second) images_of[row.head].push_back(row.image);
    }
  }
  std::vector<ImageId> heads;
  for (const auto& [head, images] : images_of) heads.push_back(head);
  std::map<std::pair<ImageId, ImageId>, PairEvidence> sums;
  for (const SubmapBorder& border : whole.borders) {
    for (const BorderEvidence& row : border.evidence) {
      const auto a = head_of.find(row.a), b = head_of.find(row.b);
      if (a == head_of.end() || b == head_of.end() || a->second == b->second) continue;
      const std::optional<Two> both = SubmapsOf(whole, row);
      if (!both || !counted.Counts(border.id, *both)) continue;
      const auto key = std::minmax(a->second, b->second);
      PairEvidence& sum = sums[key];
      sum.a = key.first, sum.b = key.second;
      sum.shared_points += row.shared_points;
      sum.agreeing_matches += row.agreeing_matches;
      sum.contradicting_matches += row.contradicting_matches;
      sum.turned_matches += row.turned_matches;
    }
  }
  std::vector<PairEvidence> evidence;
  for (const auto& [key, sum] : sums) evidence.push_back(sum);
  std::vector<std::vector<ImageId>> parts;
  for (const std::vector<ImageId>& of_heads : FindAgreeingParts(heads, evidence, bounds)) {
    std::vector<ImageId>& part = parts.emplace_back();
    for (const ImageId head : of_heads)
      part.insert(part.end(), images_of.at(head).begin(), images_of.at(head).end());
    std::ranges::sort(part);
  }
  std::ranges::stable_sort(parts, std::ranges::greater(), &std::vector<ImageId>::size);
  if (parts.size() < 2 || parts[1].size() < kImagesMin) return {};
  return parts[1];
}

// The cameras by image, each camera read once.
class Cameras {
 public:
  explicit Cameras(const Snapshot& base) : base_(base) {}

  Result<Pinhole> Get(ImageId id) {
    if (const auto found = of_image_.find(id); found != of_image_.end())
      return of_camera_.at(found->second);
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, base_.GetImage(id));
    of_image_[id] = image.camera;
    if (const auto found = of_camera_.find(image.camera); found != of_camera_.end())
      return found->second;
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, base_.GetCamera(image.camera));
    return of_camera_[image.camera] = Pinhole(camera.model);
  }

 private:
  const Snapshot& base_;
  std::map<ImageId, CameraId> of_image_;
  std::map<CameraId, Pinhole> of_camera_;
};

// The views of a tie, as far as their images are in the reconstruction.
Result<std::vector<TieView>> MakeTie(const Whole& whole, std::span<const BorderView> rows,
                                     Cameras* cameras) {
  std::vector<TieView> views;
  for (const BorderView& row : rows) {
    const auto place = whole.place_of.find(row.image);
    const auto pose = whole.poses.find(row.image);
    if (place == whole.place_of.end() || pose == whole.poses.end()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const Pinhole camera, cameras->Get(row.image));
    views.push_back({place->second, row.image, pose->second, camera, {row.x_px, row.y_px}});
  }
  return views;
}

// Each two submaps that see points together.
std::vector<SubmapPair> ListPairs(const Whole& whole, const Counted& counted) {
  std::map<Two, uint64_t> shared;
  for (const SubmapBorder& border : whole.borders) {
    for (const BorderEvidence& row : border.evidence) {
      const std::optional<Two> both = SubmapsOf(whole, row);
      if (both && both->first != both->second && counted.Counts(border.id, *both))
        shared[*both] += row.shared_points;
    }
  }
  std::vector<SubmapPair> pairs;
  for (const auto& [both, points] : shared)
    if (points > 0) pairs.push_back({both.first, both.second, points});
  return pairs;
}

Result<RelaxationProblem> MakeProblem(const Snapshot& base, const Whole& whole,
                                      const Counted& counted) {
  RelaxationProblem problem;
  problem.centers.resize(whole.submaps.size(), Eigen::Vector3d::Zero());
  std::vector<double> counts(whole.submaps.size());
  for (const auto& [image, pose] : whole.poses) {
    problem.centers[whole.place_of.at(image)] += pose.Center();
    ++counts[whole.place_of.at(image)];
  }
  for (size_t i = 0; i < counts.size(); ++i) problem.centers[i] /= std::max(1.0, counts[i]);
  problem.pairs = ListPairs(whole, counted);
  Cameras cameras(base);
  for (const SubmapBorder& border : whole.borders) {
    Status status;
    ForTies(border, [&](std::span<const BorderView> rows) {
      const std::optional<Two> both = SubmapsOf(whole, rows);
      if (!both || both->first == both->second || !counted.Counts(border.id, *both)) return;
      const Result<std::vector<TieView>> tie = MakeTie(whole, rows, &cameras);
      if (!tie.ok()) status = tie.status();
      if (!status.ok()) return;
      problem.views.insert(problem.views.end(), tie->begin(), tie->end());
      problem.first_view.push_back(static_cast<uint32_t>(problem.views.size()));
    });
    VEDUTA_RETURN_IF_ERROR(status);
  }
  return problem;
}

// The motions of the submaps, and which of their borders change.
void SetMotions(const Whole& whole, const Relaxation& relaxation, FoundRelaxation* found) {
  std::vector<Rigid3> before, after;
  for (const auto& [image, pose] : whole.poses) {
    const uint32_t place = whole.place_of.at(image);
    if (!relaxation.is_tied[place]) continue;
    before.push_back(pose);
    after.push_back(TransformCameraWorld(relaxation.new_from_old[place], pose));
  }
  const Sim3 old_from_new = FitCameras(after, before).value_or(Sim3());
  for (size_t i = 0; i < whole.submaps.size(); ++i) {
    if (!relaxation.is_tied[i]) continue;  // it moves with those beside it (SpreadMotions)
    found->motions[whole.submaps[i]] = old_from_new * relaxation.new_from_old[i];
    if (relaxation.change_px[i] > kChangeMin_px) found->changed.insert(whole.submaps[i]);
  }
}

// Relaxes the whole, and says how.
Status RelaxWhole(const Snapshot& base, const Whole& whole, const Counted& counted,
                  ThreadPool* pool, FoundRelaxation* found) {
  VEDUTA_ASSIGN_OR_RETURN(const RelaxationProblem problem, MakeProblem(base, whole, counted));
  VEDUTA_ASSIGN_OR_RETURN(const Relaxation relaxation,
                          RelaxSubmaps(problem, RelaxationOptions(), pool));
  found->how = std::to_string(whole.submaps.size()) + " submaps that ";
  if (!relaxation.is_significant) {
    found->how += "fit, ";
    return Status::Ok();
  }
  SetMotions(whole, relaxation, found);
  found->how += relaxation.is_far ? "are moved, some of them far, " : "are moved, ";
  return Status::Ok();
}

// Writes the motions into the submaps that are there now; those whose borders change are due.
Status WriteMotions(const Snapshot& base, const FoundRelaxation& found,
                    ReconstructionId reconstruction, Submaps* submaps) {
  std::map<SubmapId, Sim3> motions = found.motions;
  VEDUTA_RETURN_IF_ERROR(SpreadMotions(base, *submaps, reconstruction, &motions));
  for (const SubmapId id : submaps->List(reconstruction)) {
    const auto motion = motions.find(id);
    if (motion == motions.end()) continue;
    submaps->SetMotion(id, motion->second);
    if (found.changed.contains(id) || !found.motions.contains(id))
      submaps->MakeDue({&submaps->Find(id)->images.front(), 1});
  }
  return Status::Ok();
}

}  // namespace

Result<FoundRelaxation> FindRelaxation(const Snapshot& base, ReconstructionId reconstruction,
                                       const DoubtOptions& options, ThreadPool* pool) {
  AgreementBounds bounds = options.parts;
  bounds.contradiction_share_max =
      std::max(bounds.contradiction_share_max, options.seam_confirmed_contradiction_share_max);
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(base));
  VEDUTA_ASSIGN_OR_RETURN(const Whole whole, ReadWhole(base, submaps, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          base.GetReconstruction(reconstruction));
  FoundRelaxation found;
  found.image_count = record.image_count;
  found.without_border = ListWithoutBorder(whole, submaps);
  if (!found.without_border.empty()) return found;
  const Counted counted(whole);
  std::vector<ImageId> wrong_part = FindWrongPart(whole, counted, bounds);
  found.is_to_judge = !wrong_part.empty();
  const bool is_judged_again = found.is_to_judge && record.images_at_adjustment == 0;
  if (!is_judged_again) VEDUTA_RETURN_IF_ERROR(RelaxWhole(base, whole, counted, pool, &found));
  if (found.motions.empty()) found.wrong_part = std::move(wrong_part);
  return found;
}

Result<AdjustedWhole> WriteRelaxation(const IngestParts& parts, ReconstructionId reconstruction,
                                      const FoundRelaxation& found, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  Transaction* const transaction = scope.transaction.get();
  // Lives until the commit has come, for it holds what is written ahead.
  HealingWriter writer(parts, scope, reconstruction, &state);
  if (!found.without_border.empty()) {
    submaps.MakeDue(found.without_border);
  } else if (!found.wrong_part.empty()) {
    record.images_at_adjustment = 0;  // what is left is due again
    Healing wrong;
    wrong.parts.push_back(found.wrong_part);
    VEDUTA_RETURN_IF_ERROR(TakeOutOfRegion(parts, scope, record, wrong, &writer, &submaps));
  } else {
    VEDUTA_RETURN_IF_ERROR(WriteMotions(*scope.base, found, reconstruction, &submaps));
    const bool has_grown = record.images_at_adjustment > 0;
    record.images_at_adjustment = found.is_to_judge ? 0 : found.image_count;
    transaction->PutReconstruction(record);
    VEDUTA_RETURN_IF_ERROR(MakeHypothesesDue(*scope.base, reconstruction, {},
                                             has_grown ? Splits::kMeant : Splits::kPassedOver,
                                             transaction));
    const std::string detail = found.how + std::to_string(found.image_count) + " images";
    AppendJournal({0, 0, "veduta", "adjust", {}, reconstruction, detail}, &state, transaction);
  }
  submaps.Write(transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return writer.adjusted();
}

Result<AdjustedWhole> RelaxReconstruction(const IngestParts& parts, ReconstructionId reconstruction,
                                          WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(
      const FoundRelaxation found,
      FindRelaxation(*scope.base, reconstruction, parts.options.mapper.doubt, parts.pool));
  return WriteRelaxation(parts, reconstruction, found, std::move(scope));
}

Status MoveSubmaps(const IngestParts& parts, ReconstructionId reconstruction, SubmapId submap,
                   WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  const SubmapRecord* const found = submaps.Find(submap);
  if (found == nullptr || !found->motion)
    return Status::NotFound("there is no motion of submap " + std::to_string(submap.value));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  parts.TrimMap();
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  const MappingContext context{&loader, parts.map, parts.pool, parts.options.mapper};
  VEDUTA_ASSIGN_OR_RETURN(
      const SubmapGroup group,
      FindGroup(*scope.base, submaps, *found, true, parts.options.schedule.region_images_max));
  VEDUTA_ASSIGN_OR_RETURN(const Region region, LoadRegion(context, group.images, false));
  std::map<ImageId, Sim3> motions;
  for (const SubmapId id : group.submaps) {
    const SubmapRecord& moved = *submaps.Find(id);
    for (const ImageId image : moved.images) motions[image] = *moved.motion;
  }
  CityMap* const map = parts.map;
  for (const ImageId id : region.images)
    map->SetPose(id, TransformCameraWorld(motions.at(id), map->image(id).cam_from_world));
  // Points of which other images are the home stay where they are; setting their position again
  // measures their errors anew.
  for (const PointId id : map->PointsSeenBy(region.images)) {
    if (!std::ranges::binary_search(region.images, id.home))
      map->SetPosition(id, map->point(id).position);
  }
  for (const ImageId home : region.images) {
    for (const PointRecord& point : map->StoredBlock(home).points)
      map->SetPosition(point.id, motions.at(home) * point.position);
  }
  for (const SubmapId id : group.submaps) submaps.SetMotion(id, std::nullopt);
  HealingWriter writer(parts, scope, reconstruction, &state);
  VEDUTA_RETURN_IF_ERROR(WriteRegion(parts, scope, record, region, {}, &writer, &submaps));
  submaps.Write(scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  map->ClearChanges();
  return Status::Ok();
}

}  // namespace veduta
