// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/carrying_over.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/ingest/hypotheses.h"
#include "engine/ingest/region_writer.h"
#include "engine/ingest/submap_groups.h"
#include "engine/ingest/submap_steps.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/journal.h"
#include "engine/mapping/similarity.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// A submap becomes due where its motion leaves a camera off by more than this. It is less than the
// errors of features. Chosen by hand; not measured.
constexpr double kChangeMin_px = 0.25;

// Points of a camera whose depths are kept. Chosen by hand; not measured.
constexpr size_t kDepthsMax = 100;

// What the adjustment does to a camera, from where it is now.
struct MovedCamera {
  Rigid3 before, after;  // cam_from_world
  double focal_px = 0;
  double depth = 0;  // > 0: median of the points that it sees, before
  double scale = 1;  // > 0: how many times farther the same points are afterwards, median
};

using MovedCameras = std::map<ImageId, MovedCamera>;

using Marks = std::array<Eigen::Vector3d, 4>;

// The camera's centre, and a point at this distance along each of its axes: they fix a similarity,
// and weigh rotation and scale by what they do to what the camera sees.
Marks MarksOf(const Rigid3& cam_from_world, double distance) {
  const Rigid3 world_from_cam = cam_from_world.Inverse();
  Marks marks;
  marks[0] = world_from_cam * Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis)
    marks[axis + 1] = world_from_cam * (distance * Eigen::Vector3d::Unit(axis));
  return marks;
}

Marks Moved(const Sim3& motion, Marks marks) {
  for (Eigen::Vector3d& mark : marks) mark = motion * mark;
  return marks;
}

Marks Before(const MovedCamera& camera, double distance) {
  return MarksOf(camera.before, distance);
}

Marks After(const MovedCamera& camera, double distance) {
  return MarksOf(camera.after, camera.scale * distance);
}

// How far apart the two places of its marks, which are at its depth, are for a camera, about.
double Distance_px(const MovedCamera& camera, const Marks& a, const Marks& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most / camera.depth * camera.focal_px;
}

// The cameras of the submap that the adjustment has moved.
std::vector<MovedCamera> CamerasOf(const SubmapRecord& submap, const MovedCameras& moved) {
  std::vector<MovedCamera> cameras;
  for (const ImageId id : submap.images) {
    if (const auto camera = moved.find(id); camera != moved.end())
      cameras.push_back(camera->second);
  }
  return cameras;
}

// All cameras weigh the same: their marks are at the same distance.
std::optional<Sim3> FitMotion(const std::vector<MovedCamera>& cameras) {
  std::vector<double> depths;
  for (const MovedCamera& camera : cameras) depths.push_back(camera.depth);
  const double distance = MedianOf(std::move(depths));
  std::vector<Eigen::Vector3d> before, after;
  for (const MovedCamera& camera : cameras) {
    for (const Eigen::Vector3d& mark : Before(camera, distance)) before.push_back(mark);
    for (const Eigen::Vector3d& mark : After(camera, distance)) after.push_back(mark);
  }
  return FitSimilarity(before, after);
}

// The submaps of the reconstruction, their motions, and the weights of those beside each.
struct Motions {
  std::map<SubmapId, Sim3> of;
  std::map<SubmapId, std::map<SubmapId, uint64_t>> beside;
};

Result<Motions> FindMotions(const Snapshot& base, const Submaps& submaps, ReconstructionId own,
                            const MovedCameras& moved) {
  Motions motions;
  for (const SubmapId id : submaps.List(own)) {
    const SubmapRecord& submap = *submaps.Find(id);
    VEDUTA_ASSIGN_OR_RETURN(motions.beside[id], WeighBeside(base, submaps, submap));
    if (const std::optional<Sim3> motion = FitMotion(CamerasOf(submap, moved)))
      motions.of[id] = *motion;
  }
  VEDUTA_RETURN_IF_ERROR(SpreadMotions(base, submaps, own, &motions.of));
  return motions;
}

// Whether the submap has to be adjusted once it has been moved.
bool IsLeftOff(const SubmapRecord& submap, const Motions& motions, const MovedCameras& moved) {
  const auto own = motions.of.find(submap.id);
  const std::vector<MovedCamera> cameras = CamerasOf(submap, moved);
  if (own == motions.of.end() || cameras.size() < submap.images.size()) return true;
  for (const MovedCamera& camera : cameras) {
    const Marks before = Before(camera, camera.depth), here = Moved(own->second, before);
    if (Distance_px(camera, here, After(camera, camera.depth)) > kChangeMin_px) return true;
    for (const auto& [other, weight] : motions.beside.at(submap.id)) {
      const auto beside = motions.of.find(other);
      if (beside != motions.of.end() &&
          Distance_px(camera, here, Moved(beside->second, before)) > kChangeMin_px)
        return true;
    }
  }
  return false;
}

void SetMotions(const Motions& motions, const MovedCameras& moved, ReconstructionId own,
                Submaps* submaps) {
  for (const SubmapId id : submaps->List(own)) {
    const SubmapRecord& submap = *submaps->Find(id);
    if (IsLeftOff(submap, motions, moved)) submaps->MakeDue({&submap.images.front(), 1});
    if (const auto motion = motions.of.find(id); motion != motions.of.end())
      submaps->SetMotion(id, motion->second);
  }
}

SeeingCamera SeenFrom(const CityMap& map, const MapImage& image) {
  SeeingCamera camera{image.cam_from_world, image.camera.focal_px(), {}};
  for (const PointId point : image.points) {
    if (camera.depths.size() == kDepthsMax) break;
    const PointRecord* const seen = point.valid() ? map.FindPoint(point) : nullptr;
    const double depth = seen == nullptr ? 0 : (image.cam_from_world * seen->position).z();
    if (depth > 0) camera.depths.emplace_back(point, depth);
  }
  return camera;
}

// A camera that sees less than a fifth of the same points has got another pose elsewhere in the
// reconstruction, and says nothing of how it is bent. Chosen by hand; not measured.
bool IsElsewhere(const SeeingCamera& was, const SeeingCamera& is) {
  std::set<PointId> points;
  for (const auto& [point, depth] : was.depths) points.insert(point);
  const auto same = std::ranges::count_if(
      is.depths, [&](const auto& seen) { return points.contains(seen.first); });
  return 5 * static_cast<size_t>(same) < is.depths.size();
}

// The cameras of before that have their poses still, where they are now.
Result<std::map<ImageId, SeeingCamera>> ListNow(const IngestParts& parts,
                                                const std::shared_ptr<const Snapshot>& base,
                                                const FoundAdjustment& found) {
  std::map<ImageId, SeeingCamera> now;
  std::vector<ImageId> moved;
  for (const auto& [id, camera] : found.before) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, base->FindPose(id));
    if (!pose || pose->reconstruction != found.record.id) continue;
    const Rigid3 &was = camera.cam_from_world, &is = pose->cam_from_world;
    const bool stays =
        was.translation == is.translation && was.rotation.coeffs() == is.rotation.coeffs();
    if (stays) {
      now[id] = camera;
    } else {
      moved.push_back(id);
    }
  }
  parts.TrimMap();
  MapLoader loader(base, parts.features, parts.map, parts.pool);
  VEDUTA_RETURN_IF_ERROR(loader.LoadStructure(moved));
  for (const ImageId id : moved) {
    SeeingCamera camera = SeenFrom(*parts.map, parts.map->image(id));
    if (!IsElsewhere(found.before.at(id), camera)) now[id] = std::move(camera);
  }
  return now;
}

// What the adjustment does to these cameras, as far as they and what they see are in its map.
MovedCameras FindMoved(const std::map<ImageId, SeeingCamera>& now, const CityMap& map,
                       ReconstructionId own) {
  MovedCameras moved;
  for (const auto& [id, was] : now) {
    if (!map.HasImage(id) || map.image(id).reconstruction != own) continue;
    const Rigid3& is = map.image(id).cam_from_world;
    std::vector<double> depths, ratios;
    for (const auto& [point, depth] : was.depths) {
      const PointRecord* const seen = map.FindPoint(point);
      // Both may have given the same name to a new point since: then it is not of this camera.
      const bool is_its_own =
          seen != nullptr && std::ranges::count(seen->track, id, &TrackElement::image) > 0;
      const double afterwards = is_its_own ? (is * seen->position).z() : 0;
      if (afterwards <= 0) continue;
      depths.push_back(depth);
      ratios.push_back(afterwards / depth);
    }
    if (depths.empty()) continue;
    moved[id] = {was.cam_from_world, is, was.focal_px, MedianOf(std::move(depths)),
                 MedianOf(std::move(ratios))};
  }
  return moved;
}

// What was found against images that are where they were.
Healing HealingOf(const FoundAdjustment& found, const std::map<ImageId, SeeingCamera>& now) {
  const auto has_gone = [&](ImageId id) { return found.before.contains(id) && !now.contains(id); };
  Healing left;
  left.unplaced = found.healing.unplaced;
  left.parts = found.healing.parts;
  std::erase_if(left.unplaced,
                [&](const DoubtedImage& doubted) { return has_gone(doubted.image); });
  for (std::vector<ImageId>& part : left.parts) std::erase_if(part, has_gone);
  return left;
}

// How many images the adjustment has left in the reconstruction.
uint32_t CountAdjusted(const FoundAdjustment& found) {
  size_t taken = found.healing.unplaced.size();
  for (const std::vector<ImageId>& part : found.healing.parts) taken += part.size();
  return found.record.image_count - static_cast<uint32_t>(taken);
}

// What is forbidden of pairs of the images.
Result<std::vector<ForbiddenRecord>> ForbiddenOf(const Snapshot& snapshot,
                                                 const std::set<ImageId>& images) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ForbiddenRecord> all, snapshot.ListForbidden());
  std::erase_if(all, [&](const ForbiddenRecord& record) {
    return record.kind != ForbiddenKind::kPair || !images.contains(ImageId(record.a)) ||
           !images.contains(ImageId(record.b));
  });
  return all;
}

}  // namespace

std::map<ImageId, SeeingCamera> ListCameras(const CityMap& map, ReconstructionId reconstruction) {
  std::map<ImageId, SeeingCamera> cameras;
  for (const auto& [id, image] : map.images())
    if (image.reconstruction == reconstruction) cameras[id] = SeenFrom(map, image);
  return cameras;
}

Status NoteForbidden(const Snapshot& snapshot, FoundAdjustment* found) {
  VEDUTA_ASSIGN_OR_RETURN(found->forbidden, ForbiddenOf(snapshot, found->images));
  return Status::Ok();
}

Result<bool> IsDueAnew(const FoundAdjustment& found, const ReconstructionRecord& now,
                       const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> forbidden,
                          ForbiddenOf(snapshot, found.images));
  const auto is_same = [](const ForbiddenRecord& x, const ForbiddenRecord& y) {
    return x.a == y.a && x.b == y.b;
  };
  if (now.images_at_adjustment != found.record.images_at_adjustment ||
      !std::ranges::equal(forbidden, found.forbidden, is_same))
    return true;
  if (now.images_at_adjustment > 0) return false;
  // It was due already, so that images which have left since could not make it due.
  for (const ImageId id : found.images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(id));
    if (!pose || pose->reconstruction != found.record.id) return true;
  }
  return false;
}

Result<AdjustedWhole> CarryOver(const IngestParts& parts, const FoundAdjustment& found,
                                WriteScope scope) {
  const ReconstructionId id = found.record.id;
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record, scope.base->GetReconstruction(id));
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  if (!submaps.IsParted(id)) {
    VEDUTA_RETURN_IF_ERROR(PartIntoSubmaps(*scope.base, id, parts.options.schedule, &submaps));
    submaps.NoteAdjusted(id);  // but for those that SetMotions makes due
  }
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(const bool is_due_anew, IsDueAnew(found, record, *scope.base));
  const uint32_t adjusted = CountAdjusted(found);
  record.images_at_adjustment = is_due_anew ? 0 : adjusted;
  // Lives until the commit has come, for it holds what is written ahead.
  HealingWriter writer(parts, scope, id, &state);
  VEDUTA_ASSIGN_OR_RETURN(const auto now, ListNow(parts, scope.base, found));
  const MovedCameras moved = FindMoved(now, found.map, id);
  VEDUTA_RETURN_IF_ERROR(
      TakeOutOfRegion(parts, scope, record, HealingOf(found, now), &writer, &submaps));
  VEDUTA_ASSIGN_OR_RETURN(const Motions motions, FindMotions(*scope.base, submaps, id, moved));
  SetMotions(motions, moved, id, &submaps);
  submaps.Write(transaction);
  // Where parts were split off, or nothing is left, their hypotheses are written already.
  if (writer.split_off().empty() && !submaps.List(id).empty()) {
    VEDUTA_RETURN_IF_ERROR(MakeHypothesesDue(
        *scope.base, id, {}, is_due_anew ? Splits::kPassedOver : Splits::kMeant, transaction));
  }
  const std::string detail = std::to_string(motions.of.size()) +
                             " submaps that are moved, as others came meanwhile, " +
                             std::to_string(adjusted) + " images";
  AppendJournal({0, 0, "veduta", "adjust", {}, id, detail}, &state, transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return writer.adjusted();
}

}  // namespace veduta
