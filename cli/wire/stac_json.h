// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos as items of a SpatioTemporal Asset Catalog (STAC 1.0.0), in one collection.

#include <string>

#include "cli/wire/json.h"
#include "engine/door/photo_search.h"

namespace veduta {

inline constexpr const char* kStacPath = "/v1/stac";
inline constexpr const char* kStacCollection = "photos";

// `base` is what the paths of all links are put behind: "http://127.0.0.1:8484". It may be empty.
Json StacItem(const FoundPhoto& photo, const std::string& base);
Json StacCollection(const PhotoExtent& extent, const std::string& base);
Json StacLandingPage(const std::string& base);
// What of STAC and of OGC API Features is there, as `conformsTo`.
Json StacConformance();

// {"rel": "self", "type": ..., "href": base + path}.
Json StacLink(const char* rel, const char* type, const std::string& href);
inline constexpr const char* kGeoJson = "application/geo+json";

}  // namespace veduta
