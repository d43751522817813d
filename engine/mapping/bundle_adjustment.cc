// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "engine/mapping/reprojection_cost.h"
#include "engine/mapping/similarity.h"

namespace veduta {
namespace {

using PoseBlock = std::array<double, 7>;

PoseBlock ToBlock(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {q.x(), q.y(), q.z(), q.w(), pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

Rigid3 FromBlock(const PoseBlock& block) {
  return {Eigen::Quaterniond(block[3], block[0], block[1], block[2]).normalized(), {block[4], block[5], block[6]}};
}

// The parameters of one solve, apart from the map until it has succeeded. Ceres orders blocks by their addresses, so
// each kind lies in one array.
struct Parameters {
  std::vector<ImageId> images;          // free, ascending
  std::vector<PoseBlock> poses;         // of these
  std::vector<Eigen::Vector3d> points;  // in the order given
  bool has_held_image = false;
  uint64_t observations = 0;

  PoseBlock* FindPose(ImageId id) {
    const auto found = std::lower_bound(images.begin(), images.end(), id);
    return found == images.end() || *found != id ? nullptr : &poses[static_cast<size_t>(found - images.begin())];
  }
};

void AddResiduals(const Map& map, std::span<const PointId> points, const BundleOptions& options,
                  ceres::Problem* problem, ceres::ParameterBlockOrdering* ordering, Parameters* parameters) {
  auto* loss = new ceres::CauchyLoss(options.loss_scale_px);  // the problem owns it, as it does the costs
  for (size_t i = 0; i < points.size(); ++i) {
    double* position = parameters->points[i].data();
    for (const TrackElement& element : map.point(points[i]).track) {
      const MapImage& image = map.image(element.image);
      const Eigen::Vector2d x_px = image.ViewOf(element.feature).x_px;
      if (PoseBlock* const pose = parameters->FindPose(element.image)) {
        problem->AddResidualBlock(new ReprojectionCost(image.camera, x_px), loss, pose->data(), position);
      } else {
        problem->AddResidualBlock(new FixedPoseReprojectionCost(image.cam_from_world, image.camera, x_px), loss,
                                  position);
        parameters->has_held_image = true;
      }
      ++parameters->observations;
    }
    ordering->AddElementToGroup(position, 0);
  }
}

// Each camera as three points: its centre, and one unit (a typical spacing) along two of its axes, so that cameras
// on a line fix the gauge too.
std::vector<Eigen::Vector3d> Frame(std::span<const Rigid3> cams_from_world) {
  const double n = static_cast<double>(cams_from_world.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Rigid3& pose : cams_from_world) mean += pose.Center() / n;
  double spread = 0;
  for (const Rigid3& pose : cams_from_world) spread += (pose.Center() - mean).squaredNorm() / n;
  std::vector<Eigen::Vector3d> frame;
  for (const Rigid3& pose : cams_from_world) {
    const Eigen::Matrix3d axes = pose.rotation.toRotationMatrix().transpose();
    frame.push_back(pose.Center());
    frame.push_back(pose.Center() + std::sqrt(spread) * axes.col(0));
    frame.push_back(pose.Center() + std::sqrt(spread) * axes.col(2));
  }
  return frame;
}

Sim3 OldFromNew(const Map& map, const Parameters& parameters) {
  std::vector<Rigid3> poses_old, poses_new;
  for (size_t i = 0; i < parameters.images.size(); ++i) {
    poses_old.push_back(map.image(parameters.images[i]).cam_from_world);
    poses_new.push_back(FromBlock(parameters.poses[i]));
  }
  return FitSimilarity(Frame(poses_new), Frame(poses_old)).value_or(Sim3{});
}

void Apply(Map* map, std::span<const PointId> points, const Parameters& parameters) {
  Sim3 old_from_new;
  if (!parameters.has_held_image) old_from_new = OldFromNew(*map, parameters);
  for (size_t i = 0; i < parameters.images.size(); ++i) {
    const Rigid3 pose = FromBlock(parameters.poses[i]);
    map->SetPose(parameters.images[i], parameters.has_held_image ? pose : TransformCameraWorld(old_from_new, pose));
  }
  for (size_t i = 0; i < points.size(); ++i) {
    map->SetPosition(points[i], parameters.has_held_image ? parameters.points[i] : old_from_new * parameters.points[i]);
  }
}

}  // namespace

Status BundleOptions::Check() const {
  if (!(loss_scale_px > 0)) return Status::InvalidArgument("bundle option loss_scale_px must be positive");
  if (iterations_max < 1) return Status::InvalidArgument("bundle option iterations_max must be at least 1");
  if (!(function_tolerance > 0)) return Status::InvalidArgument("bundle option function_tolerance must be positive");
  return Status::Ok();
}

Result<BundleSummary> AdjustBundle(Map* map, std::span<const ImageId> free_images, std::span<const PointId> points,
                                   const BundleOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  BundleSummary summary;
  if (free_images.empty() || points.empty()) return summary;

  Parameters parameters;
  std::set<ImageId> seen;  // a free image that sees none of the points would be left floating
  for (const PointId id : points) {
    for (const TrackElement& element : map->point(id).track) seen.insert(element.image);
  }
  for (const ImageId id : free_images) {
    if (seen.contains(id)) parameters.images.push_back(id);
  }
  std::sort(parameters.images.begin(), parameters.images.end());
  for (const ImageId id : parameters.images) parameters.poses.push_back(ToBlock(map->image(id).cam_from_world));
  for (const PointId id : points) parameters.points.push_back(map->point(id).position);

  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  PoseManifold manifold;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  AddResiduals(*map, points, options, &problem, ordering.get(), &parameters);
  for (PoseBlock& block : parameters.poses) {
    problem.SetManifold(block.data(), &manifold);
    ordering->AddElementToGroup(block.data(), 1);
  }
  if (!parameters.has_held_image) problem.SetParameterBlockConstant(parameters.poses.front().data());

  ceres::Solver::Options solver;
  solver.linear_solver_type =
      parameters.poses.size() <= options.dense_images_max ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;  // Ceres sums in the order of its threads
  solver.max_num_iterations = static_cast<int>(options.iterations_max);
  solver.function_tolerance = options.function_tolerance;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(solver, &problem, &solved);
  if (!solved.IsSolutionUsable()) return Status::InvalidArgument("bundle adjustment failed: " + solved.message);

  Apply(map, points, parameters);
  summary.iterations = static_cast<uint32_t>(solved.iterations.size());
  summary.observations = parameters.observations;
  summary.initial_rms_px = std::sqrt(2 * solved.initial_cost / static_cast<double>(parameters.observations));
  summary.final_rms_px = std::sqrt(2 * solved.final_cost / static_cast<double>(parameters.observations));
  return summary;
}

}  // namespace veduta
