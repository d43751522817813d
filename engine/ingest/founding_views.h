// SPDX-License-Identifier: Apache-2.0
#pragma once
// The views that could found a reconstruction together with a photo.

#include <span>

#include "engine/ingest/map_loader.h"
#include "engine/mapping/founding.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

// The photo, those of its verified neighbours that have no pose (the ones with most matches first,
// up to `count_max` views in all), the photo's pairs with them and the stored pairs among them.
Result<FoundingViews> GatherFoundingViews(MapLoader* loader, const CityMap& map,
                                          const ImageFeatures& photo,
                                          std::span<const PairMatches> pairs, uint32_t count_max);

}  // namespace veduta
