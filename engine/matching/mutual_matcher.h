// SPDX-License-Identifier: Apache-2.0
#pragma once
// Mutual nearest neighbours between two images' descriptors, exactly.

#include <cstdint>
#include <vector>

#include "engine/matching/packed_descriptors.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

struct DescriptorMatch {
  FeatureIndex a = 0, b = 0;
  uint32_t distance_squared =
      0;  // |descriptor a - descriptor b|^2; root-SIFT bytes have a norm of about 512
  uint32_t second_distance_squared = 0;  // of a's best other candidate in b; UINT32_MAX if none

  bool operator==(const DescriptorMatch&) const = default;
};

// No limits by default: geometry sorts mutual neighbors out better than a threshold does.
struct MatchOptions {
  // [0, 2^32) of squared byte distance; the greatest number: off.
  uint32_t distance_squared_max = UINT32_MAX;
  // (0, 1]: distance over the second best's distance (not squared); 1: off.
  double ratio_max = 1.0;

  Status Check() const;  // the first violated bound, named with its value
};

// Features of one contrast sign that are each other's nearest (ties: lowest index), then filtered
// by `options`. Ascending in a; each feature at most once.
//
// By |x - y|^2 = |x|^2 + |y|^2 - 2 x.y in integers: the same answer on every processor.
// Deterministic; thread-safe; single-threaded. O(count_a * count_b) time: about 1.4 ms (VNNI)
// or 3.6 ms (AVX2) for 1500 x 1500 of one sign, half of that for signs in equal parts (Zen 4);
// O(count_a + count_b) scratch. `options` must pass their Check; whoever sets them asks it.
std::vector<DescriptorMatch> MatchMutual(const PackedDescriptors& a, const PackedDescriptors& b,
                                         const MatchOptions& options = {});

struct MatchesBothWays {
  std::vector<DescriptorMatch> from_a, from_b;
};

// What MatchMutual gives of (a, b) and of (b, a), at the price of one. That both are known costs
// VNNI an eighth more than the times above, which are older, and AVX2 nothing
// (veduta-bench-matching, a Xeon with both).
MatchesBothWays MatchBothWays(const PackedDescriptors& a, const PackedDescriptors& b,
                              const MatchOptions& options = {});

}  // namespace veduta
