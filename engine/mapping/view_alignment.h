// SPDX-License-Identifier: Apache-2.0
#pragma once
// The similarity between two reconstructions from what the cameras of one see of the other's
// points. At the corner of a street no point is known to both: whoever stands there sees either
// side once.

#include <optional>
#include <span>

#include "engine/mapping/resection.h"
#include "engine/mapping/similarity.h"
#include "storage/base/status.h"

namespace veduta {

struct ViewAlignmentOptions {
  // How a camera of one side is placed among the points of the other. Chosen by hand; not measured.
  ResectionOptions resection = {.inlier_count_min = 20, .inlier_share_min = 0.25};
  // >= 1. Cameras of either side that are placed so, those that see most points first. Chosen by
  // hand; not measured.
  uint32_t cameras_max = 3;
  // > 0, px. As that of the resection, after refinement by all. Chosen by hand; not measured.
  double error_px_max = 4.0;
  // >= 1. Sightings that must agree besides those of the one camera by which the similarity was
  // found: one camera leaves the scale open. As R13 asks of common points.
  uint32_t other_sightings_min = 20;
  // > 0. Standard deviation of the scale's logarithm, at most, for errors of 1 px. Chosen by hand;
  // not measured.
  double log_scale_deviation_max = 0.01;

  Status Check() const;
};

struct ViewAlignment {
  Sim3 b_from_a;
  uint32_t agreeing = 0;   // sightings
  uint32_t of_others = 0;  // those of other cameras than the one by which it was found
  double log_scale_deviation = 0;
};

// Places cameras of either side among the points of the other by P3P, which leaves the scale open;
// finds the scale that most of the other sightings agree with; refines the best by all (Ventura et
// al., "A minimal solution to the generalized pose-and-scale problem", CVPR 2014, solve all at
// once). `in_b` are cameras of b that see points of a; `in_a` the reverse. Nothing where too few
// agree or the scale stays open. Deterministic in its inputs and the seed. O(cameras * samples *
// N).
std::optional<ViewAlignment> AlignByViews(std::span<const CrossSighting> in_b,
                                          std::span<const CrossSighting> in_a, uint64_t seed,
                                          const ViewAlignmentOptions& options);

}  // namespace veduta
