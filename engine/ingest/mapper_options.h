// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers by which photos find their place in the map.

#include "engine/ingest/doubt_options.h"
#include "engine/ingest/loop_options.h"
#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/founding.h"
#include "engine/mapping/growth.h"
#include "engine/mapping/neighbor_agreement.h"
#include "engine/mapping/point_filter.h"
#include "engine/mapping/resection.h"
#include "engine/mapping/stray_points.h"
#include "engine/mapping/view_alignment.h"
#include "storage/base/status.h"

namespace veduta {

struct MapperOptions {
  // How a pose is found (pose_search.h).

  ResectionOptions resection;
  // (0, 1]. Distance to the best candidate over that to the second best, of the matches by which a
  // pose is sought. Chosen by hand; not measured.
  double putative_ratio_max = 0.88;
  // >= 1. Verified matches with one placed image from which on that image's geometry may lead to
  // the pose, where P3P finds none. Chosen by hand; not measured.
  uint32_t neighbor_match_count_min = 100;
  // Of a pose along the baseline to such a neighbour. It has one degree of freedom instead of six,
  // so fewer points serve; that they are 10 and 0.35 was chosen by hand and not measured.
  ResectionOptions along_neighbor = {.inlier_count_min = 10, .inlier_share_min = 0.35};
  // >= 1. A pose by fewer points is weak while more verified matches lead to photos without a pose:
  // it gives way to founding with them. Chosen by hand; not measured.
  uint32_t sure_inlier_count = 60;
  // >= 1. A weak pose is taken, where nothing is founded, from so many points. Chosen by hand; not
  // measured.
  uint32_t weak_inlier_count_min = 30;
  // [0, 1]. And it must agree with such a share of the points seen. Chosen by hand; not measured.
  double weak_inlier_share_min = 0.5;
  AgreementOptions agreement;  // of a pose with verified neighbours
  // > 0. Matches that contradict a pose over those that agree with it; above, the pose is dropped.
  // Chosen by hand; not measured.
  double contradiction_share_max = 0.5;
  // > 0. DeviationShare (pose_deviation.h) of a pose that is taken. On a street of 1,500 photos the
  // poses that were wrong by 5 m and more, by one house front at the far end of the street, had
  // 0.47 to 4.7 %; of 129 right ones (to 0.1 m) 95 % had at most 0.38 %. Where the points by which
  // a pose was found leave more of it open, the verified neighbours are asked too (joint_pose.h).
  double deviation_share_max = 0.005;

  // How the map grows around a photo (surroundings.h).

  // >= 2. Images whose poses a new photo may move. Chosen by hand; not measured.
  uint32_t local_images_max = 12;
  // >= 2. Images whose poses it may move before it is matched along known geometry. Chosen by hand;
  // not measured.
  uint32_t settled_images_max = 4;
  // >= 0. Images that it is matched with along known geometry. Chosen by hand; not measured.
  uint32_t guided_images_max = 8;
  // >= 0. Points that a placed image must see after adjustment; the least that a pose needs in the
  // paper's section 3.2.
  uint32_t observations_min = 20;
  GrowthOptions growth;
  // Later photos adjust again what one step leaves undone, so few steps and a wide tolerance serve.
  // Chosen by hand; not measured.
  BundleOptions local_bundle = {.iterations_max = 4, .function_tolerance = 1e-4};
  BundleOptions global_bundle = {.iterations_max = 15, .function_tolerance = 1e-4};
  PointFilterOptions filter;
  StrayOptions strays;

  // How reconstructions are merged (merging.h) and founded (reconstruction_start.h).

  // >= 3. Points that two reconstructions must have in common; R13 of docs/paper.md.
  uint32_t common_points_min = 20;
  // > 0, px. A common point, carried over, falls so near to where it is seen. Chosen by hand; not
  // measured.
  double merge_error_px_max = 6.0;
  ViewAlignmentOptions view_alignment;  // where they have too few points in common
  // >= 3. Views among which the triple that founds is chosen. Chosen by hand; not measured.
  uint32_t founding_views_max = 12;
  FoundingOptions founding;

  DoubtOptions doubt;  // what is believed, and for how long (doubt.h, seam.h)
  LoopOptions loop;    // what a loop of seams confirms (seam_loop.h)

  // The first violated bound, named with its value.
  Status Check() const;
};

}  // namespace veduta
