// SPDX-License-Identifier: Apache-2.0
#pragma once
// A place in the grid of a reconstruction's volume.

#include <compare>
#include <cstdint>

namespace veduta {

// Which block of voxels, or which tile of blocks, counted from the origin of the reconstruction's
// frame along its axes (fusion/volume/grid.h). Whether it counts blocks or tiles is said by the name
// of the variable. Ordered by x, then y, then z.
struct GridPlace {
  int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const GridPlace&) const = default;
};

}  // namespace veduta
