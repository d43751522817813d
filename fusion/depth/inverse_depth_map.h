// SPDX-License-Identifier: Apache-2.0
#pragma once
// A map of inverse depths on its way from one sweep to the next.

#include <cstdint>
#include <vector>

#include "fusion/depth/sweep_geometry.h"
#include "kernels/scanline.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Row-major; NaN where not known.
struct InverseDepthMap {
  uint32_t width_px = 0, height_px = 0;
  std::vector<float> w;  // [height x width], 1 / z
};

// Of each pixel the inverse depth of its plane, and between its neighbours by their costs: two
// lines of equal and opposite slope through the three costs meet at the minimum. `base` as in
// SweepProblem.
InverseDepthMap RefineBetweenPlanes(const PlaneChoice& choice, uint32_t width_px,
                                    uint32_t height_px, const std::vector<float>& base,
                                    const std::vector<SweepPlane>& planes);

// Sets patches of fewer than `pixels_min` pixels to not known; neighbours (of four) within
// `difference_max` of each other belong to one patch.
void RemoveSpeckles(double difference_max, uint32_t pixels_min, InverseDepthMap* map);

// Fills what is not known from the nearest known pixel left and right in its row, the farther of
// the two, for what is hidden lies behind; then whole rows from the rows above and below.
// `otherwise` where nothing is known at all.
void FillFromBackground(float otherwise, InverseDepthMap* map);

// The median of 5 x 5, and then the mean of 5 x 5 over those within `difference_max` of it; edges
// stay. Nothing may be not known. Deterministic at any number of threads.
InverseDepthMap SmoothBetweenEdges(const InverseDepthMap& map, double difference_max,
                                   ThreadPool& pool);

// At twice the size (and one more where the size is odd): each pixel is that of the half's pixel it
// lies in.
InverseDepthMap Enlarge(const InverseDepthMap& map, uint32_t width_px, uint32_t height_px);

}  // namespace veduta
