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
  // (0, 180), degrees; > 0, px; and >= 1. The rotation that a pair of so many matches has found by
  // itself may differ from that of the poses by so many degrees, or by as much as moves the picture
  // by so many px where that is more: a small picture tells less. Pairs of planes are not asked.
  // Two halves of a street that lean against each other by what is seen far away may have a kink
  // that every epipolar line bears. On right models of a street, of castle-P19 and of museum 1 pair
  // in 20 of 60 matches and more differs by more. The limit in px was chosen by hand.
  double rotation_deg_max = 2.0;
  // >= 1, and [0, 1]. So many times more where the matches of either picture lie within a narrow
  // part of it: where their standard deviation, the way it is smallest, is less than this share of
  // the width. At a corner of a rendered street such pairs (0.05 to 0.11 of the width) had
  // rotations that were 2 to 6 degrees off; of those that were spread over 0.13 and more none was
  // off by more than 1.3.
  double rotation_narrow_factor = 4.0;
  double rotation_narrow_share = 0.125;
  double rotation_px_max = 24.0;
  uint32_t rotation_matches_min = 60;

  Status Check() const;
};

// Whether the poses of two views explain their verified pair: at least half of its matches lie near
// their epipolar lines, and, as far as the matched features have points in one frame, near these.
// `other` gives the pose and the points of the pair's other image in the frame of `view`.
bool ExplainsPair(const CityMap& map, const MapImage& view, const MapImage& other,
                  const PairMatches& pair, const AgreementOptions& options);

// Whether the pair by itself has found another rotation than the poses have. One pair may be wrong
// in this; many across a seam tell of a kink.
bool IsTurned(const MapImage& view, const MapImage& other, const PairMatches& pair,
              const AgreementOptions& options);

// Counts the placed neighbours in `reconstruction` whose verified matches the view's pose explains,
// and those that it contradicts. Repeated facades bring contradictions about. Neighbours seen by a
// rotation alone have no epipolar lines and are not counted. The view need not be in the map.
NeighborAgreement CheckNeighbors(const CityMap& map, ReconstructionId reconstruction,
                                 const MapImage& view, std::span<const PairMatches> pairs,
                                 const AgreementOptions& options);

}  // namespace veduta
