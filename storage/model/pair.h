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

// An edge of the view graph: a < b always.
struct PairRecord {
  ImageId a, b;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 b_from_a;                    // translation of unit length
  std::vector<FeatureMatch> matches;  // verified inliers, ascending in a, each feature at most once
  // Of the cameras when it was verified, for they are refined later: positive, or 0 where an older
  // program wrote it, which refined none.
  double focal_a_px = 0, focal_b_px = 0;
};

struct PairNeighbor {
  ImageId image;
  uint32_t match_count = 0;
  PairGeometry geometry = PairGeometry::kGeneral;
};

}  // namespace veduta
