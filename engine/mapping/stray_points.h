// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points of two views that lie off the surface around them. Along a row of windows that are all
// alike, two photos side by side match one window with the next: the epipolar line runs along the
// row, so nothing but a depth beyond the wall, or before it, tells. A third view would tell, but
// there is none, and a few hundred such points turn a pose: on castle-P19 273 of them, at 44 to
// 137 m where the wall is at 40, moved a photo by 0.1 m.

#include <cstdint>
#include <span>

#include "engine/mapping/city_map.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct StrayOptions {
  // (0, 1]. Points of three and more views that an image sees so near to a point, as a share of the
  // image's width, are its surroundings.
  double radius_share = 1.0 / 24;
  // >= 1. So many of them tell where the surface is.
  uint32_t surrounding_min = 4;
  // > 0. A point strays if it is so much farther than the farthest of them, or nearer than the
  // nearest, as a share of that depth. All three chosen by hand, this one on orders of castle-P19
  // while points of two views counted in adjustment as any other (BundleOptions): their means
  // were 31 mm in the median without, 26 with 0.35, 25 where a tenth beyond was enough. But of 29
  // photos of a walk in Lund 21 stand in one reconstruction with 0.35, and 11 with that tenth:
  // along a street, what two views see through gaps is far behind all around it. And with 0.2 and
  // less before and beyond, a wrong merge of castle-P19 that a test forces was not split.
  double depth_share_max = 0.35;

  Status Check() const;
};

// Removes the points of two of `images` that stray in both. Their blocks must be loaded.
// Deterministic at any number of threads. O(observations of the images).
uint32_t RemoveStrayPoints(CityMap* map, std::span<const ImageId> images,
                           const StrayOptions& options, ThreadPool* pool);

}  // namespace veduta
