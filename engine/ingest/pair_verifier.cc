// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/pair_verifier.h"

#include <algorithm>
#include <cmath>

#include "storage/base/option_bounds.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

struct RankedMatches {
  std::vector<DescriptorMatch> matches;  // most distinctive first
  std::vector<Eigen::Vector2d> x_photo, x_candidate;
};

RankedMatches Rank(std::vector<DescriptorMatch> matches, const ImageFeatures& photo,
                   const ImageFeatures& candidate, double ratio_max) {
  RankedMatches ranked;
  const auto is_before = [](const DescriptorMatch& a, const DescriptorMatch& b) {
    // a.d / a.second < b.d / b.second without division
    return uint64_t{a.distance_squared} * b.second_distance_squared <
           uint64_t{b.distance_squared} * a.second_distance_squared;
  };
  std::stable_sort(matches.begin(), matches.end(), is_before);
  std::erase_if(matches, [&](const DescriptorMatch& m) {
    return !(m.distance_squared < ratio_max * ratio_max * m.second_distance_squared);
  });
  for (const DescriptorMatch& m : matches) {
    ranked.x_photo.push_back(photo.camera.Normalize(photo.features->keypoints[m.a]));
    ranked.x_candidate.push_back(candidate.camera.Normalize(candidate.features->keypoints[m.b]));
  }
  ranked.matches = std::move(matches);
  return ranked;
}

// candidate_from_photo by the photo's pose against the candidate's points. False when there are too
// few of them.
bool EstimateFromStructure(const RankedMatches& ranked, const ImageFeatures& photo,
                           const MapImage& placed, const CityMap& map, uint64_t seed,
                           const PairOptions& options, Rigid3* candidate_from_photo) {
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < ranked.matches.size(); ++i) {
    const PointId id = placed.points[ranked.matches[i].b];
    const PointRecord* point = id.valid() ? map.FindPoint(id) : nullptr;
    if (point == nullptr) continue;
    x.push_back(ranked.x_photo[i]);
    points.push_back(point->position);
  }
  if (x.size() < options.structure_count_min) return false;
  const Resection resection = Resect(x, points, photo.camera.focal_px(), seed, options.structure);
  if (resection.outcome != ResectionOutcome::kPlaced) return false;
  *candidate_from_photo = placed.cam_from_world * resection.cam_from_world.Inverse();
  const double baseline = candidate_from_photo->translation.norm();
  if (!(baseline > 0)) return false;
  candidate_from_photo->translation /= baseline;
  return true;
}

// The geometry of the pair: by the candidate's points where there are enough of them, otherwise by
// the five-point algorithm.
TwoViewGeometry Estimate(const RankedMatches& ranked, const ImageFeatures& photo,
                         const ImageFeatures& candidate, const CityMap& map, uint64_t seed,
                         const PairOptions& options) {
  const double focal_px = std::min(photo.camera.focal_px(), candidate.camera.focal_px());
  const double distance_max = options.two_view.error_px_max / focal_px;
  Rigid3 candidate_from_photo;
  if (map.HasImage(candidate.id) &&
      EstimateFromStructure(ranked, photo, map.image(candidate.id), map, seed, options,
                            &candidate_from_photo)) {
    TwoViewGeometry geometry;
    geometry.b_from_a =
        RefineTwoView(candidate_from_photo, ranked.x_photo, ranked.x_candidate, 0.5 * distance_max);
    geometry.inliers =
        FindTwoViewInliers(geometry.b_from_a, ranked.x_photo, ranked.x_candidate, distance_max);
    if (geometry.inliers.size() >= options.two_view.inlier_count_min &&
        static_cast<double>(geometry.inliers.size()) >=
            options.two_view.inlier_share_min * static_cast<double>(ranked.matches.size())) {
      geometry.outcome = TwoViewOutcome::kVerified;
      geometry.geometry = Classify(ranked.x_photo, ranked.x_candidate, geometry.inliers, focal_px,
                                   seed, options.two_view);
      return geometry;
    }
  }
  return EstimateTwoView(ranked.x_photo, ranked.x_candidate, focal_px, seed, options.two_view);
}

PairLens LensOf(const ImageFeatures& features) {
  return {features.camera.focal_px(), features.lens.k1, features.lens.k2};
}

// The record of a verified pair, with a < b and matches ascending in a.
PairRecord RecordOf(const TwoViewGeometry& geometry, const RankedMatches& ranked,
                    const ImageFeatures& photo, const ImageFeatures& candidate) {
  PairRecord pair{photo.id, candidate.id,  geometry.geometry, geometry.b_from_a,
                  {},       LensOf(photo), LensOf(candidate)};
  for (const uint32_t i : geometry.inliers)
    pair.matches.push_back({ranked.matches[i].a, ranked.matches[i].b});
  if (pair.b < pair.a) {
    std::swap(pair.a, pair.b);
    std::swap(pair.lens_a, pair.lens_b);
    pair.b_from_a = pair.b_from_a.Inverse();
    for (FeatureMatch& m : pair.matches) std::swap(m.a, m.b);
  }
  std::sort(pair.matches.begin(), pair.matches.end(),
            [](const FeatureMatch& x, const FeatureMatch& y) { return x.a < y.a; });
  return pair;
}

}  // namespace

Status PairOptions::Check() const {
  return OptionBounds()
      .Part("two_view", two_view.Check())
      .Part("structure", structure.Check())
      .AboveUpTo("ratio_max", ratio_max, 0, 1)
      .AtLeast("distinct_count_min", distinct_count_min, 1)
      .AtLeast("structure_count_min", structure_count_min, 4)
      .status();
}

std::vector<DescriptorMatch> MatchImages(const ImageFeatures& photo, const ImageFeatures& candidate,
                                         const MatchOptions& options) {
  if (candidate.matched_count_max >= photo.matched_count_max) {
    return MatchMutual(*photo.Packed(), *candidate.Packed(), options);
  }
  const auto wide = PackedDescriptors::Pack(*candidate.features, photo.matched_count_max);
  return wide.ok() ? MatchMutual(*photo.Packed(), *wide, options) : std::vector<DescriptorMatch>();
}

PairVerification VerifyPair(const ImageFeatures& photo, const ImageFeatures& candidate,
                            const CityMap& map, uint64_t seed, const PairOptions& options) {
  PairVerification verification;
  Stopwatch watch;
  const RankedMatches ranked =
      Rank(MatchImages(photo, candidate), photo, candidate, options.ratio_max);
  verification.match_ms = watch.LapMs();
  if (ranked.matches.size() < options.distinct_count_min) return verification;

  const TwoViewGeometry geometry = Estimate(ranked, photo, candidate, map, seed, options);
  verification.outcome = geometry.outcome;
  verification.inlier_count = static_cast<uint32_t>(geometry.inliers.size());
  if (geometry.outcome == TwoViewOutcome::kVerified)
    verification.pair = RecordOf(geometry, ranked, photo, candidate);
  verification.verify_ms = watch.LapMs();
  return verification;
}

}  // namespace veduta
