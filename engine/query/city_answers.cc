// SPDX-License-Identifier: Apache-2.0
#include "engine/query/city_answers.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>

#include "engine/query/earth_answers.h"
#include "engine/query/hypothesis_text.h"
#include "engine/query/journal_sight.h"
#include "engine/query/living.h"
#include "engine/query/unsure_poses.h"
#include "engine/query/visibility.h"

namespace veduta {
namespace {

struct DenseCounts {
  uint64_t depth_maps = 0, tiles = 0, triangles = 0;
};

// What the dense pass has made of each reconstruction. Reads nothing where it never ran.
Result<std::map<ReconstructionId, DenseCounts>> CountDense(const Snapshot& snapshot) {
  std::map<ReconstructionId, DenseCounts> counts;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<DenseSettings> settings,
                          snapshot.dense().ListSettings());
  if (settings.empty()) return counts;
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanDepths([&](const DepthRecord& depth) {
    ++counts[depth.reconstruction].depth_maps;
    return true;
  }));
  std::map<ReconstructionId, double> voxel_sizes;
  for (const DenseSettings& one : settings) {
    // A staged surface counts from the moment when it is the one that readers see.
    const ReconstructionId owner = OwnerOfSurface(one.reconstruction);
    if (owner == one.reconstruction) voxel_sizes[owner] = one.voxel_size;
    if (voxel_sizes[owner] != one.voxel_size) continue;
    DenseCounts* const count = &counts[owner];
    VEDUTA_RETURN_IF_ERROR(
        snapshot.dense().ScanTiles(one.reconstruction, [count](const TileRecord& tile) {
          ++count->tiles;
          count->triangles += tile.triangle_count;
          return true;
        }));
  }
  return counts;
}

ReconstructionAnswer ToAnswer(const ReconstructionRecord& record, const DenseCounts& dense) {
  ReconstructionAnswer answer;
  answer.id = record.id;
  answer.images = record.image_count;
  answer.points = record.point_count;
  answer.observations = record.observation_count;
  if (record.observation_count > 0) {
    answer.reprojection_error_px_mean =
        record.reprojection_error_px_sum / static_cast<double>(record.observation_count);
  }
  answer.geometry_version = record.geometry_version;
  answer.merged_into = record.merged_into;
  answer.dissolved = record.is_dissolved;
  const Sim3& into_from_this = record.merged_from_this;
  answer.merged_scale = into_from_this.scale;
  answer.merged_pose = ToPlain({into_from_this.rotation, into_from_this.translation});
  answer.merged_pose.center = {};
  answer.depth_maps = dense.depth_maps;
  answer.tiles = dense.tiles;
  answer.triangles = dense.triangles;
  return answer;
}

HypothesisAnswer ToAnswer(const HypothesisRecord& record) {
  HypothesisAnswer answer;
  answer.a = record.a;
  answer.b = record.b;
  answer.reason = RefusalText(record);
  answer.common_points = record.common_point_count;
  answer.pairs_for = record.agreeing_pairs;
  answer.pairs_against = record.contradicting_pairs;
  answer.matches_for = record.agreeing_matches;
  answer.matches_against = record.contradicting_matches;
  answer.parts_judged = record.judged_cells;
  answer.parts_missing = record.missing_cells;
  answer.is_open = record.reason == RefusalReason::kOpen;
  answer.scale = record.a_from_b.scale;
  answer.pose = ToPlain({record.a_from_b.rotation, record.a_from_b.translation});
  answer.pose.center = {};
  answer.image = record.image;
  answer.unsure = record.unsure;
  answer.judgments = record.judgment_count;
  answer.due = record.is_due;
  answer.time_unix_s = record.time_unix_s;
  return answer;
}

// Takes the images out of the answer that must not be told.
Status DropUnseen(const Visibility& visibility, HypothesisAnswer* answer) {
  std::vector<ImageId> seen;
  for (const ImageId image : answer->unsure) {
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(image));
    if (sees) seen.push_back(image);
  }
  answer->unsure = std::move(seen);
  if (!answer->image.valid()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(answer->image));
  if (!sees) answer->image = {};
  return Status::Ok();
}

// Puts the image's own reconstruction in the place of those that must not be told: that there are
// any says that the pose is not told.
Status DropUnseen(const Visibility& visibility, ReconstructionId own,
                  std::vector<ReconstructionId>* may_stand_in) {
  if (visibility.SeesWhole()) return Status::Ok();
  for (ReconstructionId& one : *may_stand_in) {
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(one));
    if (!sees) one = own;
  }
  std::ranges::sort(*may_stand_in);
  may_stand_in->erase(std::unique(may_stand_in->begin(), may_stand_in->end()), may_stand_in->end());
  return Status::Ok();
}

Result<std::optional<DepthMapAnswer>> DepthMapOf(const Snapshot& snapshot, ImageId image,
                                                 const Visibility& visibility) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DepthRecord> depth,
                          snapshot.dense().FindDepth(image));
  if (!depth) return std::optional<DepthMapAnswer>();
  DepthMapAnswer answer;
  answer.width_px = depth->width_px;
  answer.height_px = depth->height_px;
  answer.known_share =
      depth->known_count / (static_cast<double>(depth->width_px) * depth->height_px);
  answer.depth_near = depth->depth_near;
  answer.depth_far = depth->depth_far;
  answer.geometry_version = depth->geometry_version;
  for (const SensorPose& sensor : depth->sensors) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord record, snapshot.GetImage(sensor.image));
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(record));
    if (!sees) continue;
    answer.sensors.push_back(std::move(record.name));
  }
  return std::optional(std::move(answer));
}

}  // namespace

PlainPose ToPlain(const Rigid3& cam_from_world) {
  const Eigen::Quaterniond& q = cam_from_world.rotation;
  const Eigen::Vector3d& t = cam_from_world.translation;
  const Eigen::Vector3d center = cam_from_world.Center();
  return {
      {q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}, {center.x(), center.y(), center.z()}};
}

Result<CameraRecord> FindCamera(const Snapshot& snapshot, const std::string& name) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras, snapshot.ListCameras());
  std::string known;
  for (const CameraRecord& camera : cameras) {
    if (camera.name == name) return camera;
    known += (known.empty() ? "" : ", ") + camera.name;
  }
  return Status::NotFound(
      "there is no camera '" + name + "'; " +
      (known.empty() ? "add one with `veduta camera add`" : "the database has: " + known));
}

Result<StatusAnswer> StatusOf(const Snapshot& snapshot, const DatabaseSizes& sizes,
                              UnsureCache* unsure, const Sight& sight) {
  StatusAnswer status;
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseCounts counts, snapshot.GetCounts());
  status.images = counts.images;
  status.placed = counts.placed;
  status.postponed = counts.postponed;
  status.rejected = counts.rejected;
  status.cameras = counts.cameras;
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  status.backlog = state.pending_propagation.size();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<UploadRecord> uploads, snapshot.ListUploads());
  status.uploads = uploads.size();
  status.vocabulary_generation = state.vocabulary_generation;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> living, ListLiving(snapshot));
  VEDUTA_ASSIGN_OR_RETURN(auto dense, CountDense(snapshot));
  for (const ReconstructionRecord& record : living) {
    status.reconstructions.push_back(ToAnswer(record, dense[record.id]));
  }
  VEDUTA_RETURN_IF_ERROR(
      Visibility(snapshot, sight).Keep(&ReconstructionAnswer::id, &status.reconstructions));
  VEDUTA_ASSIGN_OR_RETURN(const auto all_unsure, unsure->Get(snapshot));
  status.unsure = all_unsure->size();
  VEDUTA_ASSIGN_OR_RETURN(status.doubtful_seams, HypothesesOf(snapshot, {}, sight));
  status.open_hypotheses = status.doubtful_seams.size();
  std::ranges::stable_sort(status.doubtful_seams, std::greater<>(),
                           &HypothesisAnswer::common_points);
  if (status.doubtful_seams.size() > kDoubtfulSeamsMax)
    status.doubtful_seams.resize(kDoubtfulSeamsMax);
  status.total_bytes = sizes.total_bytes;
  status.photo_bytes = sizes.photo_bytes;
  status.feature_bytes = sizes.feature_bytes;
  return status;
}

Result<ReconstructionAnswer> ReconstructionAnswerOf(const Snapshot& snapshot,
                                                    const ReconstructionRecord& record) {
  VEDUTA_ASSIGN_OR_RETURN(auto dense, CountDense(snapshot));
  return ToAnswer(record, dense[record.id]);
}

Result<std::vector<NeighborAnswer>> NeighborsOf(const Snapshot& snapshot, ImageId image,
                                                const Sight& sight) {
  const Visibility visibility(snapshot, sight);
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> pairs, snapshot.ListNeighbors(image));
  std::stable_sort(pairs.begin(), pairs.end(), [](const PairNeighbor& a, const PairNeighbor& b) {
    return a.match_count > b.match_count;
  });
  std::vector<NeighborAnswer> neighbors;
  for (const PairNeighbor& pair : pairs) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord other, snapshot.GetImage(pair.image));
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(other));
    if (!sees) continue;
    neighbors.push_back({pair.image, std::move(other.name), other.verdict, pair.match_count, 0});
  }
  return neighbors;
}

Result<ImageAnswer> ImageAnswerOf(const Snapshot& snapshot, const ImageRecord& image,
                                  UnsureCache* unsure, const Sight& sight) {
  const Visibility visibility(snapshot, sight);
  ImageAnswer answer;
  answer.id = image.id;
  answer.name = image.name;
  answer.verdict = image.verdict;
  answer.reason = image.reason;
  VEDUTA_ASSIGN_OR_RETURN(const bool sees_named, SeesNamed(visibility, image.detail));
  if (sees_named) answer.detail = image.detail;
  answer.camera = image.camera;
  answer.width_px = image.width_px;
  answer.height_px = image.height_px;
  answer.orientation = image.orientation;
  answer.size_bytes = image.size_bytes;
  answer.sha256 = image.photo.Hex();
  answer.contributor = image.contributor;
  answer.time_unix_s = image.time_unix_s;
  answer.features = image.feature_count;
  answer.gps = image.gps;
  answer.taken = image.taken;
  answer.contribution = image.contribution;
  VEDUTA_ASSIGN_OR_RETURN(answer.is_hidden, IsHidden(snapshot, image));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image.id));
  if (pose) {
    answer.reconstruction = pose->reconstruction;
    VEDUTA_ASSIGN_OR_RETURN(const auto all_unsure, unsure->Get(snapshot));
    const auto found = all_unsure->find(image.id);
    if (found != all_unsure->end()) answer.may_stand_in = found->second;
    VEDUTA_RETURN_IF_ERROR(DropUnseen(visibility, pose->reconstruction, &answer.may_stand_in));
    if (answer.may_stand_in.empty()) {
      answer.cam_from_world = ToPlain(pose->cam_from_world);
      VEDUTA_ASSIGN_OR_RETURN(answer.on_earth,
                              EarthPoseIn(snapshot, pose->reconstruction, pose->cam_from_world));
    }
    VEDUTA_ASSIGN_OR_RETURN(answer.hypotheses, HypothesesOf(snapshot, pose->reconstruction, sight));
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                          snapshot.GetObservations(image.id));
  answer.observations = static_cast<uint32_t>(observations.size());
  VEDUTA_ASSIGN_OR_RETURN(answer.neighbors, NeighborsOf(snapshot, image.id, sight));
  VEDUTA_ASSIGN_OR_RETURN(answer.depth_map, DepthMapOf(snapshot, image.id, visibility));
  return answer;
}

Result<std::vector<HypothesisAnswer>> HypothesesOf(const Snapshot& snapshot,
                                                   ReconstructionId reconstruction,
                                                   const Sight& sight) {
  const Visibility visibility(snapshot, sight);
  std::vector<HypothesisAnswer> answers;
  if (!visibility.SeesWhole()) return answers;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, snapshot.ListHypotheses());
  for (const HypothesisRecord& record : all) {
    const bool is_wanted =
        !reconstruction.valid() || record.a == reconstruction || record.b == reconstruction;
    if (!is_wanted) continue;
    HypothesisAnswer& answer = answers.emplace_back(ToAnswer(record));
    VEDUTA_RETURN_IF_ERROR(DropUnseen(visibility, &answer));
  }
  return answers;
}

CameraAnswer CameraAnswerOf(CameraRecord record) {
  CameraAnswer answer;
  answer.id = record.id;
  answer.name = std::move(record.name);
  answer.model = record.model;
  answer.source = std::move(record.source);
  answer.version = record.version;
  if (record.focal_stddev_share > 0) answer.focal_stddev_share = record.focal_stddev_share;
  return answer;
}

Result<std::vector<CameraAnswer>> CamerasOf(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> records, snapshot.ListCameras());
  std::vector<CameraAnswer> cameras;
  for (CameraRecord& record : records) cameras.push_back(CameraAnswerOf(std::move(record)));
  return cameras;
}

Result<std::vector<ForbiddenAnswer>> ForbiddenOf(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> all, snapshot.ListForbidden());
  std::vector<ForbiddenAnswer> answers;
  for (const ForbiddenRecord& record : all) {
    ForbiddenAnswer& answer = answers.emplace_back();
    answer.time_unix_s = record.time_unix_s;
    answer.actor = record.actor;
    answer.reason = record.reason;
    if (record.kind == ForbiddenKind::kMerge) {
      answer.kind = ForbidKind::kMerge;
      answer.reconstruction_a = ReconstructionId(record.a);
      answer.reconstruction_b = ReconstructionId(record.b);
      continue;
    }
    answer.image_a = ImageId(record.a);
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord a, snapshot.GetImage(answer.image_a));
    answer.name_a = a.name;
    if (record.kind == ForbiddenKind::kPose) {
      answer.kind = ForbidKind::kPose;
      continue;
    }
    answer.image_b = ImageId(record.b);
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord b, snapshot.GetImage(answer.image_b));
    answer.name_b = b.name;
  }
  return answers;
}

Result<std::vector<JournalAnswer>> JournalOf(const Snapshot& snapshot, uint64_t first,
                                             uint32_t count_max, const Sight& sight) {
  std::vector<JournalAnswer> entries;
  if (count_max == 0) return entries;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanJournal(first, [&](const JournalRecord& r) {
    entries.push_back(
        {r.sequence, r.time_unix_s, r.actor, r.action, r.image, r.reconstruction, r.detail});
    return entries.size() < count_max;
  }));
  VEDUTA_RETURN_IF_ERROR(MaskEntries({snapshot, sight}, &entries));
  return entries;
}

}  // namespace veduta
