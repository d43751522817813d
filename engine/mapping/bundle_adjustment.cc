// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "engine/camera/projection.h"
#include "engine/mapping/bundle_problem.h"
#include "engine/mapping/bundle_solver.h"
#include "engine/mapping/lens_deviation.h"
#include "engine/mapping/lens_solver.h"
#include "engine/mapping/similarity.h"

namespace veduta {
namespace {

// The part of the map that is adjusted.
struct Excerpt {
  BundleProblem problem;
  std::vector<ImageId> images;  // whose poses the problem holds, in its order
  // True when every image is free. The problem then holds the first image all the same, as its last
  // pose, and the result is carried back afterwards.
  bool keeps_gauge = false;
};

// Puts the free images that see one of the points first and the held ones that do after them, both
// in ascending ids. Images that see none of the points are left out: nothing would determine them.
void OrderImages(const std::vector<const MapImage*>& loaded, const std::vector<bool>& is_seen,
                 std::span<const ImageId> free_images, Excerpt* excerpt) {
  const std::set<ImageId> free(free_images.begin(), free_images.end());
  std::vector<size_t> order, held;
  for (size_t i = 0; i < loaded.size(); ++i) {
    if (is_seen[i]) (free.contains(loaded[i]->id) ? order : held).push_back(i);
  }
  BundleProblem& problem = excerpt->problem;
  excerpt->keeps_gauge = held.empty();
  if (held.empty()) std::rotate(order.begin(), order.begin() + 1, order.end());
  problem.free_count = static_cast<uint32_t>(order.size() - (held.empty() ? 1 : 0));
  order.insert(order.end(), held.begin(), held.end());
  std::vector<uint32_t> place_of(loaded.size());
  for (size_t i = 0; i < order.size(); ++i) {
    const MapImage& image = *loaded[order[i]];
    place_of[order[i]] = static_cast<uint32_t>(i);
    excerpt->images.push_back(image.id);
    problem.cams_from_world.push_back(image.cam_from_world);
    problem.cameras.push_back(image.camera);
  }
  for (BundleObservation& observation : problem.observations)
    observation.image = place_of[observation.image];
}

Result<Excerpt> MakeExcerpt(const CityMap& map, std::span<const ImageId> free_images,
                            std::span<const PointId> points) {
  std::vector<const MapImage*> loaded;
  for (const auto& [id, image] : map.images()) loaded.push_back(&image);
  std::vector<bool> is_seen(loaded.size());
  Excerpt excerpt;
  BundleProblem& problem = excerpt.problem;
  for (const PointId id : points) {
    const PointRecord& point = map.point(id);
    const auto missing = [&](const TrackElement& element, const char* what) {
      return Status::Corruption("family points: point " + std::to_string(id.home.value) + "/" +
                                std::to_string(id.ordinal) + " is seen in image " +
                                std::to_string(element.image.value) + " by a feature of " + what);
    };
    problem.points.push_back(point.position);
    problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
    for (const TrackElement& element : point.track) {
      const auto found =
          std::lower_bound(loaded.begin(), loaded.end(), element.image,
                           [](const MapImage* image, ImageId id) { return image->id < id; });
      if (found == loaded.end() || (*found)->id != element.image)
        return missing(element, "an image that has no pose");
      if (element.feature >= (*found)->features->size())
        return missing(element, "which there are fewer");
      const Keypoint& keypoint = (*found)->features->keypoints[element.feature];
      const auto place = static_cast<size_t>(found - loaded.begin());
      problem.observations.push_back(
          {static_cast<uint32_t>(place), {keypoint.x_px, keypoint.y_px}});
      is_seen[place] = true;
    }
  }
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  OrderImages(loaded, is_seen, free_images, &excerpt);
  return excerpt;
}

double SumOfWeights(const BundleProblem& problem, const BundleOptions& options) {
  double sum = 0;
  for (size_t i = 0; i < problem.points.size(); ++i) {
    sum += PointWeight(problem, i, options) *
           (problem.first_observation[i + 1] - problem.first_observation[i]);
  }
  return sum;
}

Sim3 OldFromNew(const CityMap& map, const Excerpt& excerpt) {
  std::vector<Rigid3> poses_old;
  for (const ImageId id : excerpt.images) poses_old.push_back(map.image(id).cam_from_world);
  return FitCameras(excerpt.problem.cams_from_world, poses_old).value_or(Sim3{});
}

void Apply(CityMap* map, std::span<const PointId> points, const Excerpt& excerpt) {
  const BundleProblem& problem = excerpt.problem;
  const Sim3 old_from_new = excerpt.keeps_gauge ? OldFromNew(*map, excerpt) : Sim3{};
  const size_t moved = excerpt.keeps_gauge ? excerpt.images.size() : problem.free_count;
  for (size_t i = 0; i < moved; ++i) {
    const Rigid3& pose = problem.cams_from_world[i];
    map->SetPose(excerpt.images[i],
                 excerpt.keeps_gauge ? TransformCameraWorld(old_from_new, pose) : pose);
  }
  for (size_t i = 0; i < points.size(); ++i) {
    map->SetPosition(points[i],
                     excerpt.keeps_gauge ? old_from_new * problem.points[i] : problem.points[i]);
  }
}

// Refines the lenses in place. One that would fold within its photo, for nothing is seen where it
// does, keeps its distortion. False, and nothing is changed, where there is no usable solution.
bool SolveToUsableLenses(const BundleOptions& options, BundleLenses* lenses,
                         BundleProblem* problem) {
  lenses->keeps_distortion.assign(lenses->models.size(), false);
  const auto is_usable = [](const CameraModel& model) { return CheckCamera(model).ok(); };
  for (int round = 0; round < 2; ++round) {
    BundleProblem solved = *problem;
    const auto changes = SolveWithLenses(options, *lenses, &solved);
    if (!changes) return false;
    std::vector<CameraModel> models;
    for (size_t i = 0; i < changes->size(); ++i) {
      models.push_back(ChangedLens(lenses->models[i], (*changes)[i]));
      if (!is_usable(models.back())) lenses->keeps_distortion[i] = true;
    }
    if (!std::ranges::all_of(models, is_usable)) continue;
    lenses->models = std::move(models);
    *problem = std::move(solved);
    return true;
  }
  return false;
}

}  // namespace

Result<BundleSummary> AdjustBundle(CityMap* map, std::span<const ImageId> free_images,
                                   std::span<const PointId> points, const BundleOptions& options,
                                   ThreadPool* pool) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  BundleSummary summary;
  if (free_images.empty() || points.empty()) return summary;
  VEDUTA_ASSIGN_OR_RETURN(Excerpt excerpt, MakeExcerpt(*map, free_images, points));
  const BundleSolution solution = SolveBundle(options, pool, &excerpt.problem);
  if (!solution.is_usable) return Status::InvalidArgument("bundle adjustment found no usable step");
  Apply(map, points, excerpt);
  summary.iterations = solution.iterations;
  summary.observations = excerpt.problem.observations.size();
  const double weight = SumOfWeights(excerpt.problem, options);
  const auto rms = [&](double cost) { return std::sqrt(2 * cost / weight); };
  summary.initial_rms_px = rms(solution.initial_cost);
  summary.final_rms_px = rms(solution.final_cost);
  return summary;
}

Result<bool> AdjustBundleWithLenses(CityMap* map, std::span<const ImageId> images,
                                    std::span<const PointId> points,
                                    const std::map<ImageId, uint32_t>& lens_of,
                                    const BundleOptions& options, const LensSetter& set_lens,
                                    std::span<BundleLens> lenses) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (images.empty() || points.empty() || lenses.empty()) return false;
  VEDUTA_ASSIGN_OR_RETURN(Excerpt excerpt, MakeExcerpt(*map, images, points));
  BundleLenses refined;
  for (const BundleLens& lens : lenses) refined.models.push_back(lens.model);
  for (const ImageId id : excerpt.images) {
    const auto lens = lens_of.find(id);
    refined.of_image.push_back(lens == lens_of.end() ? std::nullopt : std::optional(lens->second));
  }
  for (BundleObservation& seen : excerpt.problem.observations) {
    if (const auto lens = refined.of_image[seen.image])
      seen.x_px = DistortPixel(refined.models[*lens], seen.x_px);
  }
  if (!SolveToUsableLenses(options, &refined, &excerpt.problem)) return false;
  for (const auto& [id, lens] : lens_of) VEDUTA_RETURN_IF_ERROR(set_lens(id, refined.models[lens]));
  Apply(map, points, excerpt);
  const std::vector<double> deviations = LensDeviations(options, refined, excerpt.problem);
  for (size_t i = 0; i < lenses.size(); ++i) lenses[i] = {refined.models[i], deviations[i]};
  return true;
}

}  // namespace veduta
