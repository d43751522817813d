// SPDX-License-Identifier: Apache-2.0
#pragma once
// How poses and points are refined together (bundle_adjustment.h).

#include <cstdint>

#include "storage/base/status.h"

namespace veduta {

struct BundleOptions {
  // > 0, px. Scale of the Cauchy loss: larger errors lose weight. Chosen by hand; not measured.
  double loss_scale_px = 1.0;
  // (0, 1]. What a point of two views counts, where one of three and more counts 1. Two views are
  // one equation for their poses, and anything that lies along the line of the other view's ray
  // passes it: a wrong match is as good there as a right one, while a third view would tell. Two
  // such points of 5,900 have turned half of a street of 24 photos by 0.2 m. Means of 72 orders
  // of that street: 27 mm with 1, 34 with 0.3, 17 with 0.1, 14 with 0.03, 18 with 0.01; worst
  // photo of them 326, 1679, 296, 76 and 1623 mm. Of 20 orders of castle-P19 the median: 26.1 mm
  // with 1, 23.3 with 0.1, 23.5 with 0.03.
  double two_view_weight = 0.03;
  // >= 1. Steps tried. Chosen by hand; not measured.
  uint32_t iterations_max = 25;
  // > 0. Stops when a step lowers the cost by a smaller share; Ceres's default.
  double function_tolerance = 1e-6;
  // Up to so many free images the reduced camera system is solved densely, above by CHOLMOD; any
  // number will do, 0 is never dense. Chosen by hand; not measured.
  uint32_t dense_images_max = 40;

  Status Check() const;
};

}  // namespace veduta
