// SPDX-License-Identifier: Apache-2.0
// Verified pairs of images.
#include <algorithm>
#include <cmath>

#include "engine/camera/projection.h"
#include "engine/mapping/lens_projection.h"
#include "engine/matching/two_view.h"
#include "engine/photo/carried_features.h"
#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"

namespace veduta {
namespace {

// How far, in multiples of what verification allows by default, a stored match may lie from its
// epipolar line: other versions may have allowed more. Chosen by hand; not measured.
constexpr double kErrorSlack = 1.5;
// How much more a stored geometry may cost than after refining it on its matches. At most 0.06 on
// fountain-P11 and castle-P19, 0.25 on the tests' street; a rotation by 0.05 rad along the epipolar
// lines adds 2 (tests/engine/query/invariants_test.cc).
constexpr double kCostSlack = 0.75;
constexpr double kUnitSlack = 1e-6;  // of a translation of unit length: rounding; chosen by hand

using ImagePair = std::pair<ImageId, ImageId>;

std::string NameOfPair(ImageId a, ImageId b) {
  return "pair " + std::to_string(a.value) + "-" + std::to_string(b.value);
}

struct Sides {
  std::vector<Eigen::Vector2d> a, b;  // where the matches lie, in normalised coordinates
};

// The lens by which the pair was verified. Older programs kept k1 and k2 in step with the focal
// length.
CameraModel LensThen(const CheckedCity::Eye& eye, const PairLens& then) {
  if (then.focal_px == 0) return eye.extraction;
  const double growth = then.focal_px / Pinhole(eye.extraction).focal_px();
  CameraModel lens = ChangedLens(eye.extraction, LensChange(std::log(growth), 0, 0));
  if (then.k1 != 0 || then.k2 != 0) lens.k1 = then.k1, lens.k2 = then.k2;
  return lens;
}

// Where the lens sees the features, in normalised coordinates.
std::vector<Eigen::Vector2d> SeenBy(const CameraModel& lens, const CheckedCity::Eye& eye,
                                    const PairRecord& pair, FeatureIndex FeatureMatch::*feature) {
  std::vector<Keypoint> carried;
  for (const FeatureMatch& m : pair.matches) {
    const Eigen::Vector2f& place = eye.places_extracted()[m.*feature];
    carried.emplace_back().x_px = place.x(), carried.back().y_px = place.y();
  }
  CameraRecord camera;
  camera.model = lens;
  if (lens != eye.extraction) camera.refined_from = eye.extraction;
  CarryKeypoints(camera, carried);
  std::vector<Eigen::Vector2d> seen;
  for (const Keypoint& k : carried) seen.push_back(NormalizedFromPixel(lens, {k.x_px, k.y_px}));
  return seen;
}

// What refinement minimises: the root of the mean robust squared distance, in multiples of `scale`.
double CostOf(const Rigid3& b_from_a, const Sides& x, double scale) {
  const Eigen::Matrix3d essential = EssentialFromPose(b_from_a);
  double cost = 0;
  for (size_t i = 0; i < x.a.size(); ++i) {
    const double distance = SampsonDistance(essential, x.a[i], x.b[i]) / scale;
    cost += std::log1p(distance * distance);
  }
  return std::sqrt(cost / static_cast<double>(std::max<size_t>(1, x.a.size())));
}

// Whether the geometry explains the match. Where the rays are parallel, as those of two copies of
// one picture are, rounding alone puts the point before or behind the cameras.
bool IsExplained(const Rigid3& b_from_a, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                 double distance_max) {
  if (!FindTwoViewInliers(b_from_a, {&a, 1}, {&b, 1}, distance_max).empty()) return true;
  if (SampsonDistance(EssentialFromPose(b_from_a), a, b) >= distance_max) return false;
  const Eigen::Vector3d ray = b_from_a.rotation * a.homogeneous();
  return ray.z() > 0 && (ray.hnormalized() - b).norm() < distance_max;
}

// Whether all matches are such as the geometry would have been verified by, and whether the
// geometry is about the best for them.
bool MatchesFit(const PairRecord& pair, const CheckedCity::Eye& a, const CheckedCity::Eye& b) {
  const CameraModel lens_a = LensThen(a, pair.lens_a), lens_b = LensThen(b, pair.lens_b);
  const double focal_px = std::min(Pinhole(lens_a).focal_px(), Pinhole(lens_b).focal_px());
  const double distance_max = TwoViewOptions().error_px_max / focal_px;
  const double scale = 0.5 * distance_max;  // as in engine/ingest/pair_verifier.cc
  const Sides x{SeenBy(lens_a, a, pair, &FeatureMatch::a),
                SeenBy(lens_b, b, pair, &FeatureMatch::b)};
  for (size_t i = 0; i < x.a.size(); ++i) {
    if (!IsExplained(pair.b_from_a, x.a[i], x.b[i], kErrorSlack * distance_max)) return false;
  }
  const Rigid3 best = RefineTwoView(pair.b_from_a, x.a, x.b, scale);
  return CostOf(pair.b_from_a, x, scale) - CostOf(best, x, scale) <= kCostSlack;
}

struct Direction {
  uint32_t match_count = 0;
  PairGeometry geometry = PairGeometry::kGeneral;
  bool operator==(const Direction&) const = default;
};

}  // namespace

void CheckPair(const CheckedCity& city, const PairRecord& pair, Violations* violations) {
  const std::string name = NameOfPair(pair.a, pair.b);
  const auto eye_a = city.EyeOf(pair.a), eye_b = city.EyeOf(pair.b);
  violations->Expect(city.HasFeatures(pair.a) && city.HasFeatures(pair.b),
                     [&] { return name + " names an image that has no features"; });
  violations->Expect(std::abs(pair.b_from_a.translation.norm() - 1) < kUnitSlack,
                     [&] { return name + ": its translation is not of unit length"; });
  if (eye_a == nullptr || eye_b == nullptr) return;
  std::set<FeatureIndex> matched_b;
  bool exist = true, once = true;
  for (const FeatureMatch& m : pair.matches) {
    exist &= m.a < eye_a->keypoints.size() && m.b < eye_b->keypoints.size();
    once &= matched_b.insert(m.b).second;
  }
  violations->Expect(exist, [&] { return name + " matches a feature that does not exist"; });
  violations->Expect(once, [&] { return name + " matches a feature twice"; });
  violations->Expect(!exist || MatchesFit(pair, *eye_a, *eye_b),
                     [&] { return name + " has a match that its geometry does not explain"; });
}

Status CheckPairs(const CheckedCity& city, Violations* violations) {
  std::map<ImagePair, Direction> told, recorded;
  VEDUTA_RETURN_IF_ERROR(
      WalkRecords<PairRow>(city.snapshot, Family::kPairs, violations, [&](const PairRow& row) {
        if (row.is_neighbor) {
          told[{row.image, row.neighbor.image}] = {row.neighbor.match_count, row.neighbor.geometry};
          return;
        }
        recorded[{row.pair.a, row.pair.b}] = {static_cast<uint32_t>(row.pair.matches.size()),
                                              row.pair.geometry};
        CheckPair(city, row.pair, violations);
      }));
  for (const auto& [pair, direction] : recorded) {
    for (const ImagePair& way : {pair, ImagePair{pair.second, pair.first}}) {
      const auto found = told.find(way);
      violations->Expect(found != told.end() && found->second == direction, [&, &pair = pair] {
        return NameOfPair(pair.first, pair.second) + ": the neighbors of " + NameOf(way.first) +
               " do not say what the pair does";
      });
      if (found != told.end()) told.erase(found);
    }
  }
  for (const ForbiddenRecord& forbidden : city.forbidden) {
    const bool is_stored = forbidden.kind == ForbiddenKind::kPair &&
                           recorded.contains({ImageId(forbidden.a), ImageId(forbidden.b)});
    violations->Expect(!is_stored, [&] {
      return NameOfPair(ImageId(forbidden.a), ImageId(forbidden.b)) +
             " is stored, and somebody has forbidden it";
    });
  }
  for (const auto& [way, direction] : told) {
    violations->Add(NameOf(way.first) + " has " + NameOf(way.second) +
                    " for a neighbor, and there is no such pair");
  }
  return Status::Ok();
}

}  // namespace veduta
