// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/mapper_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {

Status MapperOptions::Check() const {
  return OptionBounds()
      .Part("resection", resection.Check())
      .AboveUpTo("putative_ratio_max", putative_ratio_max, 0, 1)
      .AtLeast("neighbor_match_count_min", neighbor_match_count_min, 1)
      .Part("along_neighbor", along_neighbor.Check())
      .AtLeast("sure_inlier_count", sure_inlier_count, 1)
      .AtLeast("weak_inlier_count_min", weak_inlier_count_min, 1)
      .Between("weak_inlier_share_min", weak_inlier_share_min, 0, 1)
      .Part("agreement", agreement.Check())
      .Above("contradiction_share_max", contradiction_share_max, 0)
      .Above("deviation_share_max", deviation_share_max, 0)
      .AtLeast("local_images_max", local_images_max, 2)
      .AtLeast("settled_images_max", settled_images_max, 2)
      .Part("growth", growth.Check())
      .Part("local_bundle", local_bundle.Check())
      .Part("global_bundle", global_bundle.Check())
      .Part("filter", filter.Check())
      .Part("strays", strays.Check())
      .AtLeast("common_points_min", common_points_min, 3)
      .Above("merge_error_px_max", merge_error_px_max, 0)
      .AtLeast("founding_views_max", founding_views_max, 3)
      .Part("view_alignment", view_alignment.Check())
      .Part("founding", founding.Check())
      .Part("doubt", doubt.Check())
      .Part("loop", loop.Check())
      .status();
}

}  // namespace veduta
