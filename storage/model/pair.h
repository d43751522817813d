// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two images that see the same scene: an edge of the view graph.

#include <cstdint>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/features.h"

namespace veduta {

enum class PairGeometry : uint8_t {
  kGeneral = 1,   // an essential matrix that no homography explains as well
  kPlanar = 2,    // a homography explains the matches: a plane seen with parallax
  kRotation = 3,  // a rotation explains the matches: no parallax, no structure
};

// What a camera's lens was when a pair was verified, for lenses are refined later.
struct PairLens {
  double focal_px = 0;    // positive, or 0 where an older program wrote it, which refined none
  double k1 = 0, k2 = 0;  // 0, too, where an older program kept them in step with the focal length

  bool operator==(const PairLens&) const = default;
};

// An edge of the view graph: a < b always.
struct PairRecord {
  ImageId a, b;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 b_from_a;                    // translation of unit length
  std::vector<FeatureMatch> matches;  // verified inliers, ascending in a, each feature at most once
  PairLens lens_a, lens_b;            // by which b_from_a was found
};

struct PairNeighbor {
  ImageId image;
  uint32_t match_count = 0;
  PairGeometry geometry = PairGeometry::kGeneral;
};

}  // namespace veduta
