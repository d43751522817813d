// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/view_alignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Scales that are tried for one camera, spread over what the sightings say. Chosen by hand; not
// measured.
constexpr size_t kScalesMax = 64;
// Error at which a sighting loses weight in the refinement. Chosen by hand; not measured.
constexpr double kRefinedErrorPx = 2.0;
// Square of the sine of an angle below which a ray says nothing of the scale: that of 0.1 degrees.
// Chosen by hand; not measured.
constexpr double kSineSquaredMin = 3e-6;

struct Candidate {
  Sim3 b_from_a;
  uint32_t agreeing = 0, of_others = 0;  // sightings; those of other cameras than the placed one
};

double ErrorPx(const CrossSighting& seen, const Eigen::Vector3d& x_cam) {
  if (!(x_cam.z() > 0)) return std::numeric_limits<double>::infinity();
  return seen.focal_px * (x_cam.hnormalized() - seen.x).norm();
}

class Alignment {
 public:
  Alignment(std::span<const CrossSighting> in_b, std::span<const CrossSighting> in_a,
            const ViewAlignmentOptions& options)
      : in_b_(in_b), in_a_(in_a), options_(options) {}

  // The best similarity of a camera of b placed among the points of a.
  Candidate FindByCamera(ImageId image, uint64_t seed) const {
    std::vector<Eigen::Vector2d> x;
    std::vector<Eigen::Vector3d> points;
    const CrossSighting* camera = nullptr;
    for (const CrossSighting& seen : in_b_) {
      if (seen.image != image) continue;
      camera = &seen;
      x.push_back(seen.x);
      points.push_back(seen.point);
    }
    const Resection placed = Resect(x, points, camera->focal_px, seed, options_.resection);
    if (placed.outcome != ResectionOutcome::kPlaced) return {};
    const Eigen::Quaterniond turn =
        camera->cam_from_world.rotation.conjugate() * placed.cam_from_world.rotation;
    const Eigen::Vector3d center_b = camera->cam_from_world.Center(),
                          center_a = placed.cam_from_world.Center();
    Candidate best;
    for (const double scale : ListScales(image, turn, center_b, center_a)) {
      const Candidate candidate =
          Count({scale, turn.normalized(), center_b - scale * (turn * center_a)}, image);
      if (candidate.of_others > best.of_others) best = candidate;
    }
    return best;
  }

  Candidate Count(const Sim3& b_from_a, ImageId image) const {
    Candidate candidate{b_from_a};
    const Sim3 a_from_b = b_from_a.Inverse();
    const auto count = [&](const CrossSighting& seen, const Sim3& carried) {
      if (ErrorPx(seen, seen.cam_from_world * (carried * seen.point)) > options_.error_px_max)
        return;
      ++candidate.agreeing;
      candidate.of_others += seen.image != image;
    };
    for (const CrossSighting& seen : in_b_) count(seen, b_from_a);
    for (const CrossSighting& seen : in_a_) count(seen, a_from_b);
    return candidate;
  }

 private:
  // x_b = center_b + scale * turn * (x_a - center_a): the scale at which each sighting of another
  // camera comes nearest to its ray.
  std::vector<double> ListScales(ImageId image, const Eigen::Quaterniond& turn,
                                 const Eigen::Vector3d& center_b,
                                 const Eigen::Vector3d& center_a) const {
    std::vector<double> scales;
    // center_b + scale * v - target lies along the ray.
    const auto append = [&](const Eigen::Vector3d& v, const Eigen::Vector3d& target,
                            const Eigen::Vector3d& ray) {
      const Eigen::Vector3d across = v.cross(ray), wanted = (target - center_b).cross(ray);
      if (across.squaredNorm() < kSineSquaredMin * v.squaredNorm()) return;
      const double scale = wanted.dot(across) / across.squaredNorm();
      if (scale > 0 && std::isfinite(scale)) scales.push_back(scale);
    };
    for (const CrossSighting& seen : in_b_) {
      if (seen.image == image) continue;
      append(turn * (seen.point - center_a), seen.cam_from_world.Center(),
             seen.cam_from_world.rotation.conjugate() * seen.x.homogeneous().normalized());
    }
    for (const CrossSighting& seen : in_a_) {
      append(turn * (seen.cam_from_world.Center() - center_a), seen.point,
             turn * (seen.cam_from_world.rotation.conjugate() * seen.x.homogeneous().normalized()));
    }
    std::ranges::sort(scales);
    if (scales.size() <= kScalesMax) return scales;
    std::vector<double> spread;
    for (size_t i = 0; i < kScalesMax; ++i)
      spread.push_back(scales[i * (scales.size() - 1) / (kScalesMax - 1)]);
    return spread;
  }

  const std::span<const CrossSighting> in_b_, in_a_;
  const ViewAlignmentOptions& options_;
};

// The cameras that see most, ascending where they see as much.
std::vector<ImageId> FindCameras(std::span<const CrossSighting> seen,
                                 const ViewAlignmentOptions& options) {
  std::map<ImageId, size_t> counts;
  for (const CrossSighting& one : seen) ++counts[one.image];
  std::vector<std::pair<size_t, ImageId>> ranked;
  for (const auto& [image, count] : counts) {
    if (count >= options.resection.inlier_count_min) ranked.emplace_back(count, image);
  }
  std::ranges::sort(ranked, [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  std::vector<ImageId> cameras;
  for (size_t i = 0; i < std::min<size_t>(ranked.size(), options.cameras_max); ++i)
    cameras.push_back(ranked[i].second);
  return cameras;
}

}  // namespace

Status ViewAlignmentOptions::Check() const {
  return OptionBounds()
      .Part("resection", resection.Check())
      .AtLeast("cameras_max", cameras_max, 1)
      .Above("error_px_max", error_px_max, 0)
      .AtLeast("other_sightings_min", other_sightings_min, 1)
      .Above("log_scale_deviation_max", log_scale_deviation_max, 0)
      .status();
}

std::optional<ViewAlignment> AlignByViews(std::span<const CrossSighting> in_b,
                                          std::span<const CrossSighting> in_a, uint64_t seed,
                                          const ViewAlignmentOptions& options) {
  const Alignment forth(in_b, in_a, options), back(in_a, in_b, options);
  Candidate best;
  ImageId placed;
  const auto consider = [&](Candidate candidate, ImageId image) {
    if (candidate.of_others > best.of_others) best = candidate, placed = image;
  };
  for (const ImageId image : FindCameras(in_b, options))
    consider(forth.FindByCamera(image, MixSeed(seed, image.value)), image);
  for (const ImageId image : FindCameras(in_a, options)) {
    Candidate candidate = back.FindByCamera(image, MixSeed(seed, image.value));
    candidate.b_from_a = candidate.b_from_a.Inverse();
    consider(candidate, image);
  }
  if (best.of_others == 0) return std::nullopt;
  const Sim3 refined = RefineSimilarity(best.b_from_a, in_b, in_a, kRefinedErrorPx);
  const double deviation = CovarianceOf(refined, in_b, in_a, kRefinedErrorPx).LogScaleDeviation();
  const Candidate final = forth.Count(refined, placed);
  if (final.of_others < options.other_sightings_min ||
      !(deviation <= options.log_scale_deviation_max))
    return std::nullopt;
  return ViewAlignment{refined, final.agreeing, final.of_others, deviation};
}

}  // namespace veduta
