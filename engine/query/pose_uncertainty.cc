// SPDX-License-Identifier: Apache-2.0
#include "engine/query/pose_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/pose_covariance.h"
#include "engine/photo/carried_features.h"
#include "engine/query/unsure_poses.h"
#include "storage/base/angle.h"

namespace veduta {
namespace {

Status Contradiction(ImageId image, const std::string& what) {
  return Status::Corruption("families points and observations: image " +
                            std::to_string(image.value) + " " + what +
                            "; `veduta verify` lists all that is damaged");
}

// An observation of the problem that waits for the place of its feature.
struct Wanted {
  FeatureIndex feature = 0;
  uint32_t observation = 0;  // index in the problem
};

// The least-squares problem of one image: it is the first pose, the free one.
class Gatherer final {
 public:
  Gatherer(const Snapshot& snapshot, const PoseRecord& pose) : snapshot_(snapshot), pose_(pose) {}

  Result<BundleProblem> Gather() {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                            snapshot_.GetReconstruction(pose_.reconstruction));
    generation_ = record.points_generation;
    problem_.free_count = 1;
    wanted_[pose_.image];
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                            snapshot_.GetObservations(pose_.image));
    for (const Observation& observation : observations)
      VEDUTA_RETURN_IF_ERROR(AddPoint(observation.point));
    problem_.first_observation.push_back(static_cast<uint32_t>(problem_.observations.size()));
    VEDUTA_RETURN_IF_ERROR(AddImage(pose_.image));
    for (const auto& [image, wanted] : wanted_) {
      if (image != pose_.image) VEDUTA_RETURN_IF_ERROR(AddImage(image));
    }
    return std::move(problem_);
  }

 private:
  Status AddPoint(PointId id) {
    if (!blocks_.contains(id.home)) {
      VEDUTA_ASSIGN_OR_RETURN(blocks_[id.home],
                              snapshot_.GetPointBlock(pose_.reconstruction, generation_, id.home));
    }
    const std::vector<PointRecord>& points = blocks_[id.home].points;
    const auto point = std::ranges::lower_bound(points, id, {}, &PointRecord::id);
    if (point == points.end() || point->id != id)
      return Contradiction(pose_.image, "sees a point that is not there");
    problem_.points.push_back(point->position);
    problem_.first_observation.push_back(static_cast<uint32_t>(problem_.observations.size()));
    for (const TrackElement& element : point->track) {
      const uint32_t index = static_cast<uint32_t>(problem_.observations.size());
      wanted_[element.image].push_back({element.feature, index});
      problem_.observations.push_back({0, Eigen::Vector2d::Zero()});
    }
    return {};
  }

  // Puts an image behind those that are there, and the places of its features where they are
  // wanted.
  Status AddImage(ImageId id) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_.FindPose(id));
    if (!pose || pose->reconstruction != pose_.reconstruction)
      return Contradiction(id, "sees a point of a reconstruction in which it has no pose");
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot_.GetImage(id));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot_.GetCamera(image.camera));
    VEDUTA_ASSIGN_OR_RETURN(Features features, snapshot_.GetFeatures(image.photo));
    CarryKeypoints(camera, features.keypoints);
    const uint32_t place = static_cast<uint32_t>(problem_.cams_from_world.size());
    problem_.cams_from_world.push_back(pose->cam_from_world);
    problem_.cameras.emplace_back(camera.model);
    for (const Wanted& wanted : wanted_[id]) {
      if (wanted.feature >= features.size())
        return Contradiction(id, "sees a point by a feature that does not exist");
      const Keypoint& keypoint = features.keypoints[wanted.feature];
      problem_.observations[wanted.observation] = {place, {keypoint.x_px, keypoint.y_px}};
    }
    return {};
  }

  const Snapshot& snapshot_;
  const PoseRecord& pose_;
  uint32_t generation_ = 0;
  BundleProblem problem_;
  std::map<ImageId, PointBlock> blocks_;  // by home
  std::map<ImageId, std::vector<Wanted>> wanted_;
};

}  // namespace

PoseUncertainty ToPlain(const PoseCovariance& found, size_t points, size_t images_held) {
  PoseUncertainty plain;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) {
      plain.covariance[static_cast<size_t>(row)][static_cast<size_t>(column)] =
          found.covariance(row, column);
    }
  }
  plain.rotation_stddev_deg =
      std::sqrt(found.covariance.topLeftCorner<3, 3>().trace()) / kRadPerDeg;
  plain.center_stddev = std::sqrt(found.covariance.bottomRightCorner<3, 3>().trace());
  plain.error_px = found.error_px;
  plain.points = static_cast<uint32_t>(points);
  plain.images_held = static_cast<uint32_t>(images_held);
  return plain;
}

Result<std::optional<PoseUncertainty>> UncertaintyOf(const Snapshot& snapshot, ImageId image,
                                                     UnsureCache* unsure) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image));
  if (!pose) return std::optional<PoseUncertainty>();
  VEDUTA_ASSIGN_OR_RETURN(const auto all_unsure, unsure->Get(snapshot));
  if (all_unsure->contains(image)) return std::optional<PoseUncertainty>();
  VEDUTA_ASSIGN_OR_RETURN(const BundleProblem problem, Gatherer(snapshot, *pose).Gather());
  const std::optional<PoseCovariance> found = CovarianceOfPose(problem, BundleOptions());
  if (!found) return std::optional<PoseUncertainty>();
  return std::optional(ToPlain(*found, problem.points.size(), problem.cams_from_world.size() - 1));
}

}  // namespace veduta
