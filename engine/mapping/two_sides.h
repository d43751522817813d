// SPDX-License-Identifier: Apache-2.0
#pragma once
// Parts things in two by which of them contradict each other and which belong together.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace veduta {

// Two things, by their indices, and how strongly they are tied or contradict each other.
struct WeightedTie {
  uint32_t a, b;
  uint32_t weight;
};

// On which of two sides each of `count` things is. The ties are taken in descending weight,
// contradictions first, each unless those before have decided about its two things: of a
// contradiction they come on different sides, else on the same one. Then the thing whose
// contradictions gain most thereby goes over to the other side, until none gains. Deterministic:
// of ties of one weight that of lower indices comes first. O(ties * log ties + moves * ties).
std::vector<bool> PartInTwo(size_t count, std::span<const WeightedTie> contradictions,
                            std::span<const WeightedTie> agreements);

}  // namespace veduta
