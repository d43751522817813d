// SPDX-License-Identifier: Apache-2.0
#pragma once
// Groups that hold together more than they are held by the rest: what may stand wrong as one body.

#include <cstdint>
#include <span>
#include <vector>

namespace veduta {

// Two nodes that are held together.
struct Link {
  uint32_t a = 0, b = 0;
};

// Joins the nodes 0..count-1 by single linkage, in the order of the links, strongest first. Each
// time two groups are joined, the smaller one is listed; of the groups that are left in the end,
// all but the largest are. No node outside of a listed group has a stronger link with one inside
// than that by which the group was joined. Each group is ascending, and comes before larger ones
// that hold it. O(links + count * log(count)).
std::vector<std::vector<uint32_t>> ListLinkedGroups(uint32_t count, std::span<const Link> links);

}  // namespace veduta
