// SPDX-License-Identifier: Apache-2.0
#pragma once
// The verified neighbours of a new photo: candidates from retrieval, then the view-graph neighbours
// of ranked and of verified images (R10), each matched and verified.

#include <map>
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
  // >= 0. Best-ranked images whose neighbours are tried too; R10 of docs/paper.md does so and names
  // no number. Chosen by hand; not measured.
  uint32_t ranked_extended_max = 3;
  // >= 1. Neighbours of one image that are tried, those with most matches first. Chosen by hand;
  // not measured.
  uint32_t extended_per_image_max = 8;
  // >= 0. Neighbours that are tried in all; 0 tries none but the candidates. The last image that
  // adds some may exceed it. Chosen by hand; not measured.
  uint32_t extended_count_max = 40;

  Status Check() const;
};

struct NeighborSearch {
  std::vector<PairRecord> pairs;  // verified; ascending other images
  uint32_t tried_count = 0;
  uint32_t best_inlier_count = 0;  // of those that failed
  ImageId best_failed;
  // Images worth another look: the verified ones, then those that failed, most consistent matches
  // first.
  std::vector<RankedImage> promising;
  // Candidates that could not be compared, since something stored of them is damaged, and what.
  std::map<ImageId, std::string> damaged;
  double match_ms = 0, verify_ms = 0;  // summed over pairs, time of one core
};

// Whether what is stored of one candidate is broken or missing, by what reading it gave. All else
// that fails is everybody's: the disk, the memory.
bool IsCandidateDamaged(const Status& status);

// A candidate that is damaged is passed over: it must not keep photos from being added. Pairs are
// spread over the pool; the result does not depend on it. Loads the structure of the
// candidates into `map`, which is the loader's. Deterministic in its inputs and the seed.
Result<NeighborSearch> FindNeighbors(const ImageFeatures& photo,
                                     std::span<const RankedImage> candidates, uint64_t seed,
                                     MapLoader* loader, const CityMap& map, ThreadPool* pool,
                                     const NeighborOptions& options);

// Adds to `search` what a second search by the same photo found among the same candidates. Of a
// pair that both have verified, the one with more matches is kept.
void JoinSearches(ImageId photo, NeighborSearch found, NeighborSearch* search);

}  // namespace veduta
