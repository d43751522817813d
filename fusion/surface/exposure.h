// SPDX-License-Identifier: Apache-2.0
#pragma once
// Exposures evened out: one gain for each photo, from the colours of points that several photos
// see.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/option_fields.h"
#include "storage/base/status.h"

namespace veduta {

struct ColorObservation {
  ImageId image;
  PointId point;
  std::array<uint8_t, 3> rgb;  // sRGB, of the photo as it is
};

// Part of the version of every gain: raise it whenever a change of the code changes what
// SolveExposures returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kExposureVersion = 1;

// The defaults were chosen by hand; not measured.
struct ExposureOptions {
  // Whether red, green and blue have a gain each; false: one gain for the three.
  bool per_channel = true;
  // (0, 10], in log light. Beyond it an observation counts less (Cauchy).
  double residual_scale = 0.1;
  // >= 1. Rounds of re-weighting.
  uint32_t iterations_max = 30;
  // >= 1. A photo with fewer shared observations keeps a gain of 1.
  uint32_t observations_min = 10;
  // [2, 1000]. Only the first observations of a point count, in ascending ids: it bounds the work.
  uint32_t views_per_point_max = 16;
  // Observations with a channel outside of these say nothing about light.
  uint8_t dark = 8, bright = 247;

  Status Check() const;  // the first violated bound, named with its value
};
VEDUTA_OPTION_FIELDS(ExposureOptions, per_channel, residual_scale, iterations_max, observations_min,
                     views_per_point_max, dark, bright)

// Minimises sum of rho(log gain_i + log light_ij - log point_j) over gains and points: iteratively
// re-weighted least squares, the points eliminated, the rest by sparse Cholesky.
//
// observations  in any order. fixed: gains that stand, of photos among them or not.
//
// Returns the gain (RGB, multiplies light) of every photo that has an observation, those fixed
// included. Photos that points join to a fixed one follow it; in each other connected group the
// mean log gain is 0 per channel. Deterministic, whatever the order of observations. O(observations
// * views per point) a round. Thread-safe. kInvalidArgument on bad options or a fixed gain that is
// not finite and positive.
Result<std::map<ImageId, Eigen::Vector3f>> SolveExposures(
    std::span<const ColorObservation> observations, const std::map<ImageId, Eigen::Vector3f>& fixed,
    const ExposureOptions& options);

}  // namespace veduta
