// SPDX-License-Identifier: Apache-2.0
#pragma once
// A part of a large reconstruction that is adjusted with those around it, and what ties them.

#include <cstdint>
#include <optional>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/transform.h"

namespace veduta {

// Images of one reconstruction that see much of the same. Either a reconstruction has no submaps,
// or each of its images is in one of them.
struct SubmapRecord {
  SubmapId id;
  ReconstructionId reconstruction;
  std::vector<ImageId> images;  // ascending; at least one
  // How many of them there were when it was last adjusted; 0: its adjustment is due.
  uint32_t images_at_adjustment = 0;
  // Where a relaxation of the whole wants it, from where it is: its images and points are still to
  // be moved so.
  std::optional<Sim3> motion = std::nullopt;
};

// One view of a place that is seen from several submaps, as it was measured in the photo. Views of
// the same place have the same number.
struct BorderView {
  uint32_t tie = 0;
  ImageId image;
  float x_px = 0, y_px = 0;
};

// What two images of different submaps, or of two fragments of one, say of each other: the sums of
// engine/mapping/agreeing_parts.h. `a` stands for its whole fragment, `b` for itself.
struct BorderEvidence {
  ImageId a, b;
  uint32_t shared_points = 0, agreeing_matches = 0, contradicting_matches = 0, turned_matches = 0;
};

// An image of the submap, and the first image of the fragment that it is in: the images of a
// fragment agree with each other.
struct BorderFragment {
  ImageId image, head;
};

// What the last adjustment of a submap found across its border.
struct SubmapBorder {
  SubmapId id;
  std::vector<BorderView> views;          // ascending ties (0, 1, ...), then images
  std::vector<BorderEvidence> evidence;   // ascending a, then b
  std::vector<BorderFragment> fragments;  // ascending images
};

}  // namespace veduta
