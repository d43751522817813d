// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/neighbor_finder.h"

#include <algorithm>
#include <set>

namespace veduta {
namespace {

// View-graph neighbours of `image` that were not tried yet, most matches first.
Status AppendNeighbors(const Snapshot& snapshot, ImageId image, const NeighborOptions& options,
                       std::set<ImageId>* tried, std::vector<ImageId>* next) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors, snapshot.ListNeighbors(image));
  std::stable_sort(
      neighbors.begin(), neighbors.end(),
      [](const PairNeighbor& a, const PairNeighbor& b) { return a.match_count > b.match_count; });
  uint32_t taken = 0;
  for (const PairNeighbor& neighbor : neighbors) {
    if (taken == options.extended_per_image_max) break;
    if (!tried->insert(neighbor.image).second) continue;
    next->push_back(neighbor.image);
    ++taken;
  }
  return Status::Ok();
}

}  // namespace

Result<NeighborSearch> FindNeighbors(const ImageFeatures& photo,
                                     std::span<const RankedImage> candidates, uint64_t seed,
                                     MapLoader* loader, const Map& map, ImageFeatureCache* features,
                                     ThreadPool* pool, const NeighborOptions& options) {
  NeighborSearch search;
  const Snapshot& snapshot = loader->snapshot();
  std::set<ImageId> tried = {photo.id};
  std::vector<ImageId> next;
  for (const RankedImage& candidate : candidates) {
    if (tried.insert(candidate.image).second) next.push_back(candidate.image);
  }
  uint32_t extended = 0;
  std::vector<std::pair<uint32_t, ImageId>> failed;  // by how many matches were consistent
  for (bool first = true; !next.empty(); first = false) {
    VEDUTA_RETURN_IF_ERROR(loader->LoadStructure(next));
    std::vector<Result<PairVerification>> verified(next.size(), PairVerification());
    pool->ParallelFor(next.size(), [&](size_t i) {
      const auto candidate = features->Get(snapshot, next[i]);
      verified[i] = candidate.ok() ? Result(VerifyPair(photo, **candidate, map,
                                                       MixSeed(seed, next[i].value), options.pair))
                                   : candidate.status();
    });
    std::vector<ImageId> extend;
    if (first) {
      for (size_t i = 0; i < std::min<size_t>(options.ranked_extended_max, candidates.size());
           ++i) {
        extend.push_back(candidates[i].image);
      }
    }
    for (size_t i = 0; i < next.size(); ++i) {
      if (!verified[i].ok()) return verified[i].status();
      PairVerification& v = *verified[i];
      ++search.tried_count;
      search.match_ms += v.match_ms;
      search.verify_ms += v.verify_ms;
      if (v.outcome == TwoViewOutcome::kVerified) {
        search.pairs.push_back(std::move(v.pair));
        search.promising.push_back({next[i], 0});
        extend.push_back(next[i]);
        continue;
      }
      failed.emplace_back(v.inlier_count, next[i]);
      if (v.inlier_count > search.best_inlier_count || !search.best_failed.valid()) {
        search.best_inlier_count = v.inlier_count;
        search.best_failed = next[i];
      }
    }
    next.clear();
    for (const ImageId id : extend) {
      if (extended >= options.extended_count_max) break;
      const size_t before = next.size();
      VEDUTA_RETURN_IF_ERROR(AppendNeighbors(snapshot, id, options, &tried, &next));
      extended += static_cast<uint32_t>(next.size() - before);
    }
  }
  std::stable_sort(failed.begin(), failed.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  for (const auto& [inliers, id] : failed) search.promising.push_back({id, 0});
  const auto other = [&](const PairRecord& pair) { return pair.a == photo.id ? pair.b : pair.a; };
  std::sort(search.pairs.begin(), search.pairs.end(),
            [&](const PairRecord& x, const PairRecord& y) { return other(x) < other(y); });
  return search;
}

}  // namespace veduta
