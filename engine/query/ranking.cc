// SPDX-License-Identifier: Apache-2.0
#include "engine/query/ranking.h"

#include <algorithm>

#include "engine/matching/mutual_matcher.h"

namespace veduta {
namespace {

constexpr double kRatioMax = 0.85;  // of the ratio test; chosen by hand, not measured

// Scores every image by matching.
Result<std::vector<RankedImage>> RankByMatching(const Snapshot& snapshot, const Features& features,
                                                Retrieval* retrieval, ImageFeatureCache* cache,
                                                ThreadPool* pool) {
  VEDUTA_ASSIGN_OR_RETURN(const PackedDescriptors packed,
                          PackedDescriptors::Pack(features, cache->matched_count_max()));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<RankedImage> ranked,
                          retrieval->Candidates(snapshot, features));
  std::vector<Status> failures(ranked.size());
  MatchOptions options;
  options.ratio_max = kRatioMax;
  pool->ParallelFor(ranked.size(), [&](size_t i) {
    const auto stored = cache->Get(snapshot, ranked[i].image);
    if (!stored.ok()) {
      failures[i] = stored.status();
      return;
    }
    const size_t matches = MatchMutual(packed, *(*stored)->Packed(), options).size();
    ranked[i].score = static_cast<double>(matches) / std::max<double>(1, packed.count());
  });
  for (const Status& failure : failures) VEDUTA_RETURN_IF_ERROR(failure);
  return ranked;
}

}  // namespace

Result<std::vector<RankedImage>> RankFeatures(const Snapshot& snapshot, const Features& features,
                                              uint32_t count_max, Retrieval* retrieval,
                                              ImageFeatureCache* cache, ThreadPool* pool) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words, retrieval->Words(snapshot, features));
  if (!words.empty()) return retrieval->RankWords(snapshot, words, count_max);
  VEDUTA_ASSIGN_OR_RETURN(std::vector<RankedImage> ranked,
                          RankByMatching(snapshot, features, retrieval, cache, pool));
  std::stable_sort(ranked.begin(), ranked.end(), [](const RankedImage& a, const RankedImage& b) {
    return a.score != b.score ? a.score > b.score : a.image < b.image;
  });
  if (ranked.size() > count_max) ranked.resize(count_max);
  return ranked;
}

}  // namespace veduta
