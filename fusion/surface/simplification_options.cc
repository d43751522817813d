// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/simplification_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status SimplificationOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("distance_max", distance_max, 0)
      .AboveUpTo("normal_turn_deg_max", normal_turn_deg_max, 0, 90)
      .AboveUpTo("color_error_max", color_error_max, 0, 442)
      .status();
}

}  // namespace veduta
