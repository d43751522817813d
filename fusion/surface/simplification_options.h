// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far a simplified surface may be from the one before (simplification.h).

#include "storage/base/status.h"

namespace veduta {

struct SimplificationOptions {
  double distance_max =
      0;  // > 0, world units: between old and new surface, both ways; there is no default
  bool keep_border =
      true;  // border vertices stay where and what they are, so that tiles still fit together
  double normal_turn_deg_max = 60;  // (0, 90]; no triangle turns further in one step
  double color_error_max =
      16;  // (0, 442], sRGB: nor does the surface's colour change more, next to there; 442: any

  Status Check() const;  // the first violated bound, named with its value
};

}  // namespace veduta
