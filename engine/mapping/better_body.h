// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a few images of a reconstruction belong elsewhere as one body, judged by what they and
// the rest see of each other. better_pose.h asks the same of one image.

#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/city_map.h"
#include "engine/mapping/pair_matches.h"

namespace veduta {

// Candidate bodies of 2 to `images_max` images: the groups that single linkage lists of `images`
// (ascending; single_linkage.h), those with most points in common first. O(points * track
// length^2).
std::vector<std::vector<ImageId>> ListBodies(const CityMap& map, std::span<const ImageId> images,
                                             size_t images_max);

// Verified matches of an image of the body with an image that is not of it.
struct BodyPair {
  ImageId image;
  PairMatches matches;
};

// The similarity that carries the body to its better place (body_place.h), if there is one. Photos
// that were placed by each other share an error: the points that they see together keep each of
// them where it is, and what would draw all of them back lies outside of the bounds of a track. So
// points that the rest agrees on are put where the rest sees them, those of the body where the body
// does, as if the two were reconstructions of their own. Reads the map only. Deterministic in its
// inputs.
std::optional<Sim3> FindBetterPlace(const CityMap& map, std::span<const ImageId> body,
                                    std::span<const BodyPair> pairs);

}  // namespace veduta
