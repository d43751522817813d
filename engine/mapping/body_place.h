// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a part of a reconstruction belongs as one body, by what it and the rest see of each other.

#include <cstdint>
#include <optional>
#include <span>

#include "engine/mapping/similarity.h"

namespace veduta {

struct BodyPlace {
  Sim3 new_from_old;  // of the body
  double share = 0;   // of what is seen across, how much it explains
};

// The similarity that carries the body to where clearly more of what is seen across agrees than
// where it stands, if there is one: near by, or wherever views of either side place the other
// (view_alignment.h). Or to where near by all of it fits clearly better. `in_rest` are cameras of
// the rest that see points of the body; `in_body` the reverse; all in the one frame that they have
// now. Deterministic in its inputs and the seed. O(N), and 20 ms where it seeks far away.
std::optional<BodyPlace> FindBodyPlace(std::span<const CrossSighting> in_rest,
                                       std::span<const CrossSighting> in_body, uint64_t seed);

}  // namespace veduta
