// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/placement.h"

#include <algorithm>
#include <functional>
#include <map>

#include "engine/matching/two_view.h"

namespace veduta {

PairMatches MatchesFrom(const PairRecord& pair, ImageId image) {
  PairMatches seen{image == pair.a ? pair.b : pair.a, pair.geometry, pair.b_from_a, pair.matches};
  if (image == pair.b) {
    seen.other_from_photo = pair.b_from_a.Inverse();
    for (FeatureMatch& match : seen.matches) std::swap(match.a, match.b);
  }
  return seen;
}

PairRecord RecordOf(const PairMatches& pair, ImageId photo) {
  if (photo < pair.other)
    return {photo, pair.other, pair.geometry, pair.other_from_photo, pair.matches};
  PairRecord record{pair.other, photo, pair.geometry, pair.other_from_photo.Inverse(),
                    pair.matches};
  for (FeatureMatch& match : record.matches) std::swap(match.a, match.b);
  std::sort(record.matches.begin(), record.matches.end(),
            [](const FeatureMatch& x, const FeatureMatch& y) { return x.a < y.a; });
  return record;
}

namespace {

StructureMatches GatherStructure(const Map& map, ReconstructionId reconstruction,
                                 const Features& features, const Pinhole& camera,
                                 std::span<const PairMatches> pairs,
                                 const std::function<bool(const PointRecord&)>& accept) {
  std::map<FeatureIndex, std::map<PointId, uint32_t>> votes;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    const MapImage& other = map.image(pair.other);
    for (const FeatureMatch& match : pair.matches) {
      const PointId point = other.points[match.b];
      const PointRecord* record = point.valid() ? map.FindPoint(point) : nullptr;
      if (record != nullptr && accept(*record)) ++votes[match.a][point];
    }
  }
  struct Entry {
    uint32_t votes;
    FeatureIndex feature;
    PointId point;
  };
  std::vector<Entry> entries;
  for (const auto& [feature, points] : votes) {
    Entry best{0, feature, {}};
    for (const auto& [point, count] : points) {
      if (count > best.votes) best = {count, feature, point};
    }
    entries.push_back(best);
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.votes > b.votes; });
  StructureMatches found;
  for (const Entry& entry : entries) {
    found.features.push_back(entry.feature);
    found.points.push_back(entry.point);
    found.x.push_back(camera.Normalize(features.keypoints[entry.feature]));
    found.positions.push_back(map.point(entry.point).position);
  }
  return found;
}

}  // namespace

StructureMatches GatherStructure(const Map& map, ReconstructionId reconstruction,
                                 const Features& features, const Pinhole& camera,
                                 std::span<const PairMatches> pairs) {
  return GatherStructure(map, reconstruction, features, camera, pairs,
                         [](const PointRecord&) { return true; });
}

std::optional<Resection> FindBetterPose(const Map& map, ImageId id,
                                        std::span<const PairMatches> matches, uint64_t seed,
                                        const ResectionOptions& options) {
  const MapImage& image = map.image(id);
  // Points that would not be there without this image say what it has always said.
  const auto stands_alone = [id](const PointRecord& point) {
    return std::count_if(point.track.begin(), point.track.end(),
                         [id](const TrackElement& e) { return e.image != id; }) >= 2;
  };
  const StructureMatches structure = GatherStructure(map, image.reconstruction, *image.features,
                                                     image.camera, matches, stands_alone);
  Resection found =
      Resect(structure.x, structure.positions, image.camera.focal_px(), seed, options);
  if (found.outcome != ResectionOutcome::kPlaced) return std::nullopt;
  size_t explained = 0;
  for (size_t i = 0; i < structure.x.size(); ++i) {
    const Sighting view = image.ViewOf(structure.features[i]);
    explained += ReprojectionErrorPx(view, structure.positions[i]) <= options.error_px_max;
  }
  // Images that are right find their own pose again, give or take a point.
  if (found.inliers.size() < explained + explained / 20 + 5) return std::nullopt;
  return found;
}

NeighborAgreement CheckNeighbors(const Map& map, ReconstructionId reconstruction,
                                 const Rigid3& cam_from_world, const Features& features,
                                 const Pinhole& camera, std::span<const PairMatches> pairs,
                                 double error_px_max) {
  NeighborAgreement agreement;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    const MapImage& other = map.image(pair.other);
    const Rigid3 other_from_cam = other.cam_from_world * cam_from_world.Inverse();
    // Without parallax the pair has no epipolar lines to disagree about.
    if (pair.geometry == PairGeometry::kRotation) continue;
    const Eigen::Matrix3d essential = EssentialFromPose(other_from_cam);
    const double distance_max = error_px_max / std::min(camera.focal_px(), other.camera.focal_px());
    uint64_t explained = 0;
    for (const FeatureMatch& match : pair.matches) {
      explained += SampsonDistance(essential, camera.Normalize(features.keypoints[match.a]),
                                   other.camera.Normalize(other.features->keypoints[match.b])) <
                   distance_max;
    }
    const bool agrees = 2 * explained >= pair.matches.size();
    ++(agrees ? agreement.agreeing_images : agreement.contradicting_images);
    (agrees ? agreement.agreeing_matches : agreement.contradicting_matches) += pair.matches.size();
  }
  return agreement;
}

}  // namespace veduta
