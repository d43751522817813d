// SPDX-License-Identifier: Apache-2.0
#pragma once
// Parts a view graph into pieces of bounded size that few edges lead out of, as nested dissection
// does (George, 1973; for bundle adjustment: Ni, Steedly and Dellaert, ICCV 2007).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

struct ViewGraphEdge {
  ImageId a, b;
  uint32_t weight = 0;  // > 0: the more, the less it is to be cut
};

// Cuts `images` (ascending, each once) in two, and again, until no part has more than `images_max`
// (>= 1). Two images that lie far from each other in the graph grow by turns, each by the image
// that most weight ties to it. Edges of images that are not given are passed over. Parts in
// ascending first images; images ascending. O((images + edges) log(images)) for each halving.
// Deterministic.
std::vector<std::vector<ImageId>> PartViewGraph(std::span<const ImageId> images,
                                                std::span<const ViewGraphEdge> edges,
                                                size_t images_max);

}  // namespace veduta
