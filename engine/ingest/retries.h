// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which photos without a pose are to be tried again because others got one (R16).
//
// A photo that has failed beside many placed neighbours fails beside one more in nearly all cases,
// and among fronts that are all alike nearly every photo is a neighbour of every other. So a photo
// is tried again with each of the first 16 neighbours that get a pose, and later only as often as
// their number has grown by a quarter: as often as its logarithm.

#include <cstdint>
#include <span>

#include "engine/ingest/placement.h"
#include "engine/mapping/city_map.h"
#include "storage/database.h"

namespace veduta {

// Appends to the photos that are to be tried again the neighbours without a pose of all that the
// placement has placed; those that wait already once only. `unstored` are the neighbours of the
// photo at hand, placed.front(), whose pairs `base` does not hold yet. Where reconstructions were
// merged, all such neighbours are tried again. Reads, for each of them, its neighbours and which of
// them have a pose.
Status AppendRetries(const CityMap& map, const Snapshot& base, const Placement& placement,
                     std::span<const ImageId> unstored, DatabaseState* state);

// Whether a photo is tried again when its neighbours with a pose, `before` until now, are `after`.
bool IsWorthAnother(uint32_t before, uint32_t after);

}  // namespace veduta
