// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/two_sides.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace veduta {
namespace {

// Sets of things of which it is known who is on whose side.
class SidedSets {
 public:
  explicit SidedSets(size_t count) : parent_(count), is_opposite_(count, false) {
    std::iota(parent_.begin(), parent_.end(), uint32_t{0});
  }

  void Join(uint32_t a, uint32_t b, bool are_opposite) {
    const auto [root_a, side_a] = Find(a);
    const auto [root_b, side_b] = Find(b);
    if (root_a == root_b) return;
    parent_[root_b] = root_a;
    is_opposite_[root_b] = (side_a != side_b) != are_opposite;
  }

  // The root of the set, and whether `a` is on the other side than it.
  std::pair<uint32_t, bool> Find(uint32_t a) {
    uint32_t root = a;
    bool side = false;
    while (parent_[root] != root) {
      side = side != is_opposite_[root];
      root = parent_[root];
    }
    // Shortens the way.
    bool left = side;
    while (parent_[a] != root && a != root) {
      const uint32_t next = parent_[a];
      const bool step = is_opposite_[a];
      parent_[a] = root;
      is_opposite_[a] = left;
      left = left != step;
      a = next;
    }
    return {root, side};
  }

 private:
  std::vector<uint32_t> parent_;
  std::vector<bool> is_opposite_;  // to its parent
};

std::vector<WeightedTie> Descending(std::span<const WeightedTie> ties) {
  std::vector<WeightedTie> sorted(ties.begin(), ties.end());
  std::ranges::sort(sorted, [](const WeightedTie& x, const WeightedTie& y) {
    return std::tie(y.weight, x.a, x.b) < std::tie(x.weight, y.a, y.b);
  });
  return sorted;
}

// What of the contradictions of each thing its move to the other side would settle, less what it
// would bring.
std::vector<int64_t> ListGains(const std::vector<bool>& sides,
                               std::span<const WeightedTie> contradictions) {
  std::vector<int64_t> gains(sides.size(), 0);
  for (const WeightedTie& tie : contradictions) {
    const int64_t gain = sides[tie.a] == sides[tie.b] ? tie.weight : -int64_t{tie.weight};
    gains[tie.a] += gain;
    gains[tie.b] += gain;
  }
  return gains;
}

}  // namespace

std::vector<bool> PartInTwo(size_t count, std::span<const WeightedTie> contradictions,
                            std::span<const WeightedTie> agreements) {
  std::vector<bool> sides(count, false);
  if (count == 0) return sides;
  SidedSets sets(count);
  for (const WeightedTie& tie : Descending(contradictions)) sets.Join(tie.a, tie.b, true);
  for (const WeightedTie& tie : Descending(agreements)) sets.Join(tie.a, tie.b, false);
  for (size_t i = 0; i < count; ++i) sides[i] = sets.Find(static_cast<uint32_t>(i)).second;
  while (true) {
    const std::vector<int64_t> gains = ListGains(sides, contradictions);
    const auto most = std::ranges::max_element(gains);
    if (*most <= 0) return sides;
    const auto i = static_cast<size_t>(most - gains.begin());
    sides[i] = !sides[i];
  }
}

}  // namespace veduta
