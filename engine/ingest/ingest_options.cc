// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/ingest_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status AdjustmentSchedule::Check() const {
  return OptionBounds()
      .AtLeast("views_step", views_step, 1)
      .AtLeast("submap_views_step", submap_views_step, 1)
      .Above("growth_share", growth_share, 0)
      .Above("long_growth_share", long_growth_share, 0)
      .AtLeast("whole_images_max", whole_images_max, 3)
      .Between("submap_images_max", submap_images_max, 3, whole_images_max)
      .AtLeast("submap_images_min", submap_images_min, 1)
      .AtLeast("region_images_max", region_images_max, submap_images_max)
      .Above("whole_again_share", whole_again_share, 0)
      .Above("relaxation_share", relaxation_share, 0)
      .status();
}

Status IngestOptions::Check() const {
  return OptionBounds()
      .Part("retrieval", retrieval.Check())
      .Part("neighbors", neighbors.Check())
      .Part("mapper", mapper.Check())
      .Part("schedule", schedule.Check())
      .AtLeast("map_images_max", map_images_max, 1)
      .AtLeast("feature_cache_bytes", static_cast<double>(feature_cache_bytes), 1)
      .Between("matched_count_max", matched_count_max, 1, kPackedCountMax)
      .Between("thorough_count_max", thorough_count_max, matched_count_max, kPackedCountMax)
      .AtLeast("thorough_pairs_max", thorough_pairs_max, 1)
      .AtLeast("ample_match_count", ample_match_count, 1)
      .status();
}

}  // namespace veduta
