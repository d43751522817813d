// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/better_pose.h"

#include <algorithm>

#include "engine/mapping/structure_matches.h"

namespace veduta {
namespace {

// An image whose pose is right finds the same pose again, with a few points more or fewer. So
// another pose must explain a twentieth and 5 points more. Chosen by hand; not measured.
bool IsClearlyMore(size_t found, size_t explained) {
  return found >= explained + explained / 20 + 5;
}

}  // namespace

std::optional<Resection> FindBetterPose(const CityMap& map, ImageId id,
                                        std::span<const PairMatches> matches, uint64_t seed,
                                        const ResectionOptions& options) {
  const MapImage& image = map.image(id);
  // Points that would not be there without this image can only repeat what it says.
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
  if (!IsClearlyMore(found.inliers.size(), explained)) return std::nullopt;
  return found;
}

}  // namespace veduta
