// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers by which photos are added.

#include <cstddef>
#include <cstdint>

#include "engine/ingest/mapper_options.h"
#include "engine/ingest/neighbor_finder.h"
#include "engine/retrieval/retrieval.h"
#include "storage/base/status.h"

namespace veduta {

// When the adjustment of a whole reconstruction is due.
struct AdjustmentSchedule {
  // >= 1. After so many more images. The paper's section 3.3 has 15. With 5, four of a hundred
  // orders of castle-P19 ended with a photo 0.3 to 0.6 m off: two parts had been merged and
  // adjusted at 16 images, and three more photos came. With 2 (and the share below) those four came
  // out at 25 to 33 mm, for 17 % more processor time; a street of 150 took 10 % more.
  uint32_t views_step = 2;
  // > 0. After such a share of more images, where that is more than views_step, in a reconstruction
  // that is adjusted in a turn of the writer.
  double growth_share = 0.05;
  // > 0. The same in a larger one that has no submaps: it bounds what adjustments cost for each
  // photo added. Chosen by hand; not measured.
  double long_growth_share = 0.20;
  // >= 3. A reconstruction of more images is parted into submaps (submaps.h). Chosen by hand.
  uint32_t whole_images_max = 200;
  // [3, whole_images_max]. Images that a submap has at most when it is adjusted. Chosen by hand.
  uint32_t submap_images_max = 12;
  // >= submap_images_max. Images that are adjusted at once in a turn of the writer: those of a
  // submap, and of the submaps around it. A larger whole is adjusted without a turn. Chosen by
  // hand.
  uint32_t region_images_max = 48;
  // >= 1. It is adjusted after so many more images; M in the paper's section 3.3.
  uint32_t submap_views_step = 4;
  // >= 1. A submap of fewer images joins the one beside it, where there is room. Chosen by hand.
  uint32_t submap_images_min = 4;
  // > 0. Where such a reconstruction has grown by such a share, it is adjusted and judged as a
  // whole all the same: groups of 48 bend slowly, and no relaxation of stiff submaps sees that. In
  // a city of 1,500 photos whose groups alone were adjusted, one adjustment of the whole took the
  // mean error from 0.19 m to 0.04. Up to whole_again_images_max images (>= 0), for it costs time
  // and memory for each of them. Both were chosen by hand.
  double whole_again_share = 0.2;
  uint32_t whole_again_images_max = 2000;
  // > 0. A larger one is relaxed and judged as its submaps instead (relaxation_steps.h), where it
  // has grown by such a share. Chosen by hand.
  double relaxation_share = 0.1;

  Status Check() const;
};

struct IngestOptions {
  RetrievalOptions retrieval;
  NeighborOptions neighbors;
  MapperOptions mapper;
  AdjustmentSchedule schedule;
  // >= 1. Images up to which the map is kept in memory between photos. Chosen by hand; not
  // measured.
  uint32_t map_images_max = 400;
  // >= 1. Chosen by hand; not measured.
  size_t feature_cache_bytes = 768ull << 20;
  // [1, 65535]. Features of an image that are matched, the strongest; R11 of docs/paper.md.
  uint32_t matched_count_max = 1500;
  // [matched_count_max, 65535]. Features of a photo that those do not place. Chosen by hand; not
  // measured.
  uint32_t thorough_count_max = 4096;
  // >= 1. Images that such a photo is then matched with. Chosen by hand; not measured.
  uint32_t thorough_pairs_max = 10;
  // >= 1. A neighbour with so many verified matches makes the second search unnecessary, unless the
  // photo is postponed. Chosen by hand; not measured.
  uint32_t ample_match_count = 250;

  // The first violated bound of these and of all options inside them, named with its value:
  // "mapper.resection.inlier_count_min is 0, but must be 4 or more".
  Status Check() const;
};

}  // namespace veduta
