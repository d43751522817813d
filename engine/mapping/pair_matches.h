// SPDX-License-Identifier: Apache-2.0
#pragma once
// The matches of one photo with another, as that photo sees them.

#include <vector>

#include "storage/base/transform.h"
#include "storage/model/pair.h"

namespace veduta {

// Matches of the photo at hand with one other image.
struct PairMatches {
  ImageId other;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 other_from_photo;            // translation of unit length
  std::vector<FeatureMatch> matches;  // a: feature of the photo at hand; b: feature of `other`
  // By which `other_from_photo` was found; a focal length of 0 for those of now (PairRecord).
  PairLens lens_photo, lens_other;
};

// The record as seen from `image`, which must be one of its two.
PairMatches MatchesFrom(const PairRecord& pair, ImageId image);
// The inverse of MatchesFrom: the record to store, with a < b and matches ascending in a.
PairRecord RecordOf(const PairMatches& pair, ImageId photo);

}  // namespace veduta
