// SPDX-License-Identifier: Apache-2.0
#pragma once
// The depth maps of several key views against each other: what two of them agree on stays.

#include <cstdint>
#include <span>

#include "storage/base/option_fields.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/model/depth_map.h"
#include "storage/model/view.h"

namespace veduta {

// A neighbouring key view's own depth map, not yet checked itself.
struct NeighborDepth {
  ViewGeometry geometry;
  const DepthMap* map = nullptr;
};

// Part of the version of every checked depth map: raise it whenever a change of the code changes
// what CheckConsistency returns (tests/fusion/pass/pinned_bytes_test.cc notices).
// 2: uncertain depth wants one neighbour more.
inline constexpr uint32_t kConsistencyVersion = 2;

// The defaults were chosen by hand; no measurement is recorded.
struct ConsistencyOptions {
  // (0, 1), relative. Depths that differ by less agree.
  double depth_error_max = 0.01;
  // (0, 100] px in the key view, there and back by the neighbour's depth.
  double pixel_error_max = 1.5;
  // [1, 64]. Neighbours that must agree.
  uint32_t agreement_count_min = 1;
  // [0, 255]. Where the key map's confidence is lower, one more must agree: in most of the sky, on
  // few walls.
  uint32_t confidence_sure = 32;

  Status Check() const;
};
VEDUTA_OPTION_FIELDS(ConsistencyOptions, depth_error_max, pixel_error_max, agreement_count_min,
                     confidence_sure)

// `key_map` without the pixels that fewer than agreement_count_min neighbours confirm, or that more
// neighbours contradict than confirm. A neighbour confirms a point when its own depth where the
// point projects leads back to within pixel_error_max and depth_error_max; it contradicts it when
// it sees through it (its depth there is larger by more than the tolerance); a neighbour that sees
// something nearer, or nothing, says nothing. Confidence of what stays grows with the number of
// neighbours that agree.
//
// Deterministic, thread-safe, O(pixels * neighbours). kInvalidArgument naming a map whose size is
// not its view's.
Result<DepthMap> CheckConsistency(const DepthMap& key_map, const ViewGeometry& key,
                                  std::span<const NeighborDepth> neighbors,
                                  const ConsistencyOptions& options, ThreadPool& pool);

}  // namespace veduta
