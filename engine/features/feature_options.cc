// SPDX-License-Identifier: Apache-2.0
#include "engine/features/feature_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status FeatureOptions::Check() const {
  return OptionBounds()
      .Between("feature_count_max", feature_count_max, 1, 65535)
      .Inside("contrast_threshold", contrast_threshold, 0, 1)
      .AboveUpTo("edge_ratio_max", edge_ratio_max, 1, 1000)
      .Between("sigma", sigma, 1.4, 4)
      .status();
}

}  // namespace veduta
