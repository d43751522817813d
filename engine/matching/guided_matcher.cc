// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/guided_matcher.h"

#include <algorithm>
#include <string>

#include "engine/matching/matcher_kernels.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

struct BestTwo {
  FeatureIndex feature = 0;
  uint32_t distance = kNoMatch;
  uint32_t second_distance = kNoMatch;
};

// The nearest of the candidates, and the distance of the nearest that lies farther than apart_px
// from it.
BestTwo PickBest(const Features& features, const GuidedScratch& scratch, double apart_px) {
  BestTwo best;
  for (size_t i = 0; i < scratch.candidates.size(); ++i) {
    const FeatureIndex feature = scratch.candidates[i];
    const uint32_t distance = scratch.distances[i];
    if (distance < best.distance || (distance == best.distance && feature < best.feature)) {
      best.feature = feature;
      best.distance = distance;
    }
  }
  if (best.distance == kNoMatch) return best;
  const Keypoint& at = features.keypoints[best.feature];
  for (size_t i = 0; i < scratch.candidates.size(); ++i) {
    if (scratch.distances[i] >= best.second_distance || scratch.candidates[i] == best.feature)
      continue;
    const Keypoint& other = features.keypoints[scratch.candidates[i]];
    const double dx = static_cast<double>(other.x_px) - at.x_px;
    const double dy = static_cast<double>(other.y_px) - at.y_px;
    if (dx * dx + dy * dy > apart_px * apart_px) best.second_distance = scratch.distances[i];
  }
  return best;
}

void MeasureDistances(const MatcherKernels& kernels, const uint8_t* descriptor,
                      const Features& features, GuidedScratch* scratch) {
  scratch->distances.resize(scratch->candidates.size());
  kernels.distances(descriptor, features.descriptors.data(), scratch->candidates.data(),
                    scratch->candidates.size(), scratch->distances.data());
}

Status CheckFeatures(const Features& features, const char* name) {
  if (features.descriptors.size() == features.size() * kDescriptorSize) return Status::Ok();
  return Status::InvalidArgument(
      "image " + std::string(name) + " has " + std::to_string(features.size()) + " keypoints but " +
      std::to_string(features.descriptors.size()) + " bytes of descriptors, not 128 each");
}

// F at a scale that neither overflows nor vanishes; zero if it has none.
Eigen::Matrix3d Normalized(const Eigen::Matrix3d& f) {
  if (!f.allFinite()) return Eigen::Matrix3d::Zero();
  const double largest = f.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return Eigen::Matrix3d::Zero();
  return f / largest;
}

// Finds the candidates in b along the epipolar line of one feature of a.
class BandSearch final {
 public:
  BandSearch(const Features& b, const FeatureGrid& b_grid, const Eigen::Matrix3d& f,
             const GuidedMatchOptions& options)
      : b_(b), b_grid_(b_grid), f_(f), options_(options) {}

  void Find(const Keypoint& a, std::vector<FeatureIndex>* candidates) const {
    candidates->clear();
    const Eigen::Vector3d x_a(a.x_px, a.y_px, 1.0);
    const Eigen::Vector3d line = f_ * x_a;
    b_grid_.FindNearLine(ContrastClassOf(a.contrast_sign), {line.x(), line.y(), line.z()},
                         options_.band_px, candidates);
    std::erase_if(*candidates, [&](FeatureIndex feature) {
      const Keypoint& b = b_.keypoints[feature];
      return !InBandOfB(x_a, b) || !ScalesAgree(a.scale_px, b.scale_px);
    });
  }

 private:
  // Whether x_a is within the band of x_b's epipolar line. False where x_b is the epipole, which
  // has no line.
  bool InBandOfB(const Eigen::Vector3d& x_a, const Keypoint& b) const {
    const Eigen::Vector3d line = f_.transpose() * Eigen::Vector3d(b.x_px, b.y_px, 1.0);
    const double residual = line.dot(x_a);
    const double length_squared = line.x() * line.x() + line.y() * line.y();
    return length_squared > 0 &&
           residual * residual <= options_.band_px * options_.band_px * length_squared;
  }

  bool ScalesAgree(double a, double b) const {
    if (std::isinf(options_.scale_ratio_max)) return true;
    return a <= b * options_.scale_ratio_max && b <= a * options_.scale_ratio_max;
  }

  const Features& b_;
  const FeatureGrid& b_grid_;
  const Eigen::Matrix3d f_;
  const GuidedMatchOptions& options_;
};

bool Passes(const DescriptorMatch& match, const GuidedMatchOptions& options) {
  if (match.distance_squared > options.distance_squared_max) return false;
  if (options.ratio_max >= 1.0 || match.second_distance_squared == kNoMatch) return true;
  return match.distance_squared <=
         options.ratio_max * options.ratio_max * match.second_distance_squared;
}

}  // namespace

Status GuidedMatchOptions::Check() const {
  return OptionBounds()
      .AboveUpTo("band_px", band_px, 0, 64)
      .AboveUpTo("ratio_max", ratio_max, 0, 1)
      .AtLeast("apart_px", apart_px, 0)
      .AtLeast("scale_ratio_max", scale_ratio_max, 1)
      .status();
}

Result<std::vector<DescriptorMatch>> MatchGuided(const Features& a, const Features& b,
                                                 const FeatureGrid& b_grid,
                                                 const Eigen::Matrix3d& b_from_a,
                                                 const GuidedMatchOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckFeatures(a, "a"));
  VEDUTA_RETURN_IF_ERROR(CheckFeatures(b, "b"));
  if (b_grid.feature_count() != b.size()) {
    return Status::InvalidArgument("the grid is of " + std::to_string(b_grid.feature_count()) +
                                   " features, image b has " + std::to_string(b.size()));
  }
  const MatcherKernels& kernels = BestMatcherKernels();
  const BandSearch search(b, b_grid, Normalized(b_from_a), options);

  // The band is symmetric, so one walk over the features of a finds every pair, and the same
  // distances tell the best of each feature of b.
  std::vector<DescriptorMatch> best_of_a;
  std::vector<Nearest> best_of_b(b.size(), {kNoMatch, kNoMatch});
  GuidedScratch scratch;
  for (FeatureIndex i = 0; i < a.size(); ++i) {
    search.Find(a.keypoints[i], &scratch.candidates);
    if (scratch.candidates.empty()) continue;
    MeasureDistances(kernels, a.descriptor(i), b, &scratch);
    for (size_t k = 0; k < scratch.candidates.size(); ++k) {
      Nearest& nearest = best_of_b[scratch.candidates[k]];
      if (scratch.distances[k] < nearest.distance) nearest = {i, scratch.distances[k]};
    }
    const BestTwo best = PickBest(b, scratch, options.apart_px);
    const DescriptorMatch match = {i, best.feature, best.distance, best.second_distance};
    if (Passes(match, options)) best_of_a.push_back(match);
  }
  std::erase_if(best_of_a,
                [&](const DescriptorMatch& match) { return best_of_b[match.b].best != match.a; });
  return best_of_a;
}

std::optional<NearFeature> FindNear(const FeatureGrid& grid, const Features& features,
                                    const NearQuery& query, GuidedScratch* scratch) {
  if (query.descriptor == nullptr || grid.feature_count() != features.size()) return std::nullopt;
  scratch->candidates.clear();
  grid.FindNearPoint(ContrastClassOf(query.contrast_sign), query.x_px, query.y_px, query.radius_px,
                     &scratch->candidates);
  if (scratch->candidates.empty()) return std::nullopt;
  MeasureDistances(BestMatcherKernels(), query.descriptor, features, scratch);
  const BestTwo best = PickBest(features, *scratch, query.apart_px);
  if (best.distance > query.distance_squared_max) return std::nullopt;
  return NearFeature{best.feature, best.distance, best.second_distance};
}

}  // namespace veduta
