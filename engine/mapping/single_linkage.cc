// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/single_linkage.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace veduta {

std::vector<std::vector<uint32_t>> ListLinkedGroups(uint32_t count, std::span<const Link> links) {
  std::vector<uint32_t> group_of(count);
  std::iota(group_of.begin(), group_of.end(), 0);
  std::vector<std::vector<uint32_t>> groups(count), listed;
  for (uint32_t i = 0; i < count; ++i) groups[i] = {i};
  const auto append = [&](std::vector<uint32_t> group) {
    std::ranges::sort(group);
    listed.push_back(std::move(group));
  };
  for (const Link& link : links) {
    uint32_t into = group_of[link.a], from = group_of[link.b];
    if (into == from) continue;
    if (groups[into].size() < groups[from].size()) std::swap(into, from);
    std::vector<uint32_t> moved = std::move(groups[from]);
    groups[from].clear();
    for (const uint32_t node : moved) group_of[node] = into;
    groups[into].insert(groups[into].end(), moved.begin(), moved.end());
    append(std::move(moved));
  }
  const auto largest = std::ranges::max_element(groups, {}, &std::vector<uint32_t>::size);
  for (auto it = groups.begin(); it != groups.end(); ++it)
    if (it != largest && !it->empty()) append(std::move(*it));
  return listed;
}

}  // namespace veduta
