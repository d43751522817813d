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

// Joins `images` (ascending) by single linkage: the two that have most points in common come first.
// Each time two groups are joined, the smaller one is a candidate body; of the groups that are left
// in the end, all but the largest are. Returns the candidates of 2 to `images_max` images. No image
// outside of one shares more points with an image inside than the weakest tie by which it was
// joined. Each is ascending, and comes before larger ones that hold it. O(points * track length^2).
std::vector<std::vector<ImageId>> ListBodies(const CityMap& map, std::span<const ImageId> images,
                                             size_t images_max);

// Verified matches of an image of the body with an image that is not of it.
struct BodyPair {
  ImageId image;
  PairMatches matches;
};

// The similarity that carries the body to where clearly more of what is seen across agrees than
// where it stands, if there is one: near by, or wherever views of either side place the other
// (view_alignment.h). Photos that were placed by each other share an error: the points that they
// see together keep each of them where it is, and what would draw all of them back lies outside of
// the bounds of a track. So points that the rest agrees on are put where the rest sees them, those
// of the body where the body does, as if the two were reconstructions of their own. Reads the map
// only. Deterministic in its inputs.
std::optional<Sim3> FindBetterPlace(const CityMap& map, std::span<const ImageId> body,
                                    std::span<const BodyPair> pairs);

}  // namespace veduta
