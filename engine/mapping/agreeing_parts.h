// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which images of a reconstruction belong together by all that speaks for and against it. A wrong
// merge by a repeated facade holds two parts together by few points, while verified pairs across
// the seam contradict it.

#include <span>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

// What is known of two images of one reconstruction.
struct PairEvidence {
  ImageId a, b;
  uint32_t shared_points = 0;
  // Verified matches of pairs that the poses explain, and of those that they do not.
  uint32_t agreeing_matches = 0, contradicting_matches = 0;
  uint32_t turned_matches = 0;  // of those that agree: of pairs with another rotation (IsTurned)
};

struct AgreementBounds {
  // >= 1. Points that hold two parts together. Chosen by hand; not measured.
  uint32_t shared_points_min = 10;
  // > 0. Matches across a seam that contradict it over those that agree; above, the parts do not
  // belong together. Chosen by hand: the two halves of a street with a kink had 0.8.
  double contradiction_share_max = 0.7;

  // Whether pairs with another rotation contradict.
  bool counts_turned = true;

  Status Check() const;
};

// Partitions `images` (ascending). Begins with each image as a part of its own, and joins the parts
// of the two images that share most points first, unless what is known of all images of the two
// parts speaks against it. Parts in descending size, then by their first image; images ascending.
// O(evidence * log) where parts agree. Deterministic.
std::vector<std::vector<ImageId>> FindAgreeingParts(std::span<const ImageId> images,
                                                    std::span<const PairEvidence> evidence,
                                                    const AgreementBounds& bounds);

}  // namespace veduta
