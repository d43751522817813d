// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a photo's verified neighbours agree with the pose that was found for it (R14).

#include <cstdint>
#include <span>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"
#include "storage/base/status.h"

namespace veduta {

struct NeighborAgreement {
  uint32_t agreeing_images = 0, contradicting_images = 0;
  uint64_t agreeing_matches = 0, contradicting_matches = 0;
};

struct AgreementOptions {
  // > 0, px. Distance from the epipolar line at which a match still agrees with a pose. Chosen by
  // hand; not measured.
  double line_error_px_max = 6.0;
  // > 0, px. Where a matched feature has a point, distance of the match from where the point falls.
  // Wider, for the depth of a point that few images see is uncertain. Along the line of a street,
  // the epipolar lines of one window are those of all windows beside it: only this tells them
  // apart. Chosen by hand; not measured.
  double point_error_px_max = 15.0;

  Status Check() const;
};

// Whether the poses of two views explain their matches: at least half of them lie near their
// epipolar lines, and, as far as the matched features have points in one frame, near these. `other`
// gives the pose and the points of the pair's other image in the frame of `view`.
bool ExplainsMatches(const CityMap& map, const MapImage& view, const MapImage& other,
                     std::span<const FeatureMatch> matches, const AgreementOptions& options);

// Counts the placed neighbours in `reconstruction` whose verified matches the view's pose explains,
// and those that it contradicts. Repeated facades bring contradictions about. Neighbours seen by a
// rotation alone have no epipolar lines and are not counted. The view need not be in the map.
NeighborAgreement CheckNeighbors(const CityMap& map, ReconstructionId reconstruction,
                                 const MapImage& view, std::span<const PairMatches> pairs,
                                 const AgreementOptions& options);

}  // namespace veduta
