// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status BundleOptions::Check() const {
  return OptionBounds()
      .Above("loss_scale_px", loss_scale_px, 0)
      .AboveUpTo("two_view_weight", two_view_weight, 0, 1)
      .AtLeast("iterations_max", iterations_max, 1)
      .Above("function_tolerance", function_tolerance, 0)
      .status();
}

}  // namespace veduta
