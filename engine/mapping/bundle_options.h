// SPDX-License-Identifier: Apache-2.0
#pragma once
// How poses and points are refined together (bundle_adjustment.h).

#include <cstdint>

#include "storage/base/status.h"

namespace veduta {

struct BundleOptions {
  // > 0, px. Scale of the Cauchy loss: larger errors lose weight. Chosen by hand; not measured.
  double loss_scale_px = 1.0;
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
