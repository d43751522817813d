// SPDX-License-Identifier: Apache-2.0
#pragma once
// The verified neighbours of a new photo: candidates from retrieval, then the view-graph neighbours
// of ranked and of verified images (R10), each matched and verified.

#include <span>
#include <string>
#include <vector>

#include "engine/ingest/map_loader.h"
#include "engine/ingest/pair_verifier.h"
#include "index/scoring.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct NeighborOptions {
  PairOptions pair;
  uint32_t ranked_extended_max = 3;     // best-ranked images whose neighbours are tried as well
  uint32_t extended_per_image_max = 8;  // neighbours of one image, those with most matches first
  uint32_t extended_count_max = 40;     // in all
};

struct NeighborSearch {
  std::vector<PairRecord> pairs;  // ascending other images
  uint32_t tried_count = 0;
  uint32_t best_inlier_count = 0;  // of those that failed
  ImageId best_failed;
  std::vector<RankedImage>
      promising;  // verified, then those that failed with most consistent matches
  double match_ms = 0, verify_ms = 0;  // summed over pairs, of one core
};

// Pairs are spread over the pool; the result does not depend on it. Also loads the structure of the
// candidates.
Result<NeighborSearch> FindNeighbors(const ImageFeatures& photo,
                                     std::span<const RankedImage> candidates, uint64_t seed,
                                     MapLoader* loader, const Map& map, ImageFeatureCache* features,
                                     ThreadPool* pool, const NeighborOptions& options);

}  // namespace veduta
