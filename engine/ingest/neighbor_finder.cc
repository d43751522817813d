// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/neighbor_finder.h"

#include <algorithm>
#include <map>
#include <set>

#include "storage/base/option_bounds.h"

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

// One search, round by round: what a round verifies leads to the images of the next.
class Finder {
 public:
  Finder(const ImageFeatures& photo, MapLoader* loader, const NeighborOptions& options)
      : photo_(photo), loader_(loader), options_(options), tried_{photo.id} {}

  // Candidates in the order of their rank, each once.
  std::vector<ImageId> FirstRound(std::span<const RankedImage> candidates) {
    std::vector<ImageId> round;
    for (const RankedImage& candidate : candidates) {
      if (tried_.insert(candidate.image).second) round.push_back(candidate.image);
    }
    const size_t count = std::min<size_t>(options_.ranked_extended_max, candidates.size());
    for (size_t i = 0; i < count; ++i) leads_.push_back(candidates[i].image);
    return round;
  }

  // Matches and verifies the photo with each image of the round, side by side over the pool.
  std::vector<Result<PairVerification>> Verify(const std::vector<ImageId>& round,
                                               const CityMap& map, uint64_t seed,
                                               ThreadPool* pool) const {
    std::vector<Result<PairVerification>> verified(round.size(), PairVerification());
    pool->ParallelFor(round.size(), [&](size_t i) {
      const auto candidate = loader_->features()->Get(loader_->snapshot(), round[i]);
      verified[i] = candidate.ok()
                        ? Result(VerifyPair(photo_, **candidate, map, MixSeed(seed, round[i].value),
                                            options_.pair))
                        : candidate.status();
    });
    return verified;
  }

  void Note(ImageId image, PairVerification verification) {
    ++search_.tried_count;
    search_.match_ms += verification.match_ms;
    search_.verify_ms += verification.verify_ms;
    if (verification.outcome == TwoViewOutcome::kVerified) {
      search_.pairs.push_back(std::move(verification.pair));
      search_.promising.push_back({image, 0});
      leads_.push_back(image);
      return;
    }
    failed_.emplace_back(verification.inlier_count, image);
    if (verification.inlier_count > search_.best_inlier_count || !search_.best_failed.valid()) {
      search_.best_inlier_count = verification.inlier_count;
      search_.best_failed = image;
    }
  }

  // Loads the candidates with their points, and returns those that are not damaged.
  Result<std::vector<ImageId>> LoadSound(std::span<const ImageId> round) {
    std::vector<ImageId> sound;
    for (const ImageId id : round) {
      const Status loaded = loader_->LoadStructure({&id, 1});
      if (IsCandidateDamaged(loaded)) {
        PassOver(id, loaded.message());
        continue;
      }
      VEDUTA_RETURN_IF_ERROR(loaded);
      sound.push_back(id);
    }
    return sound;
  }

  void PassOver(ImageId image, std::string what) { search_.damaged[image] = std::move(what); }

  // The neighbours of the images that lead further.
  Result<std::vector<ImageId>> NextRound() {
    std::vector<ImageId> round;
    for (const ImageId id : leads_) {
      if (extended_count_ >= options_.extended_count_max) break;
      const size_t before = round.size();
      VEDUTA_RETURN_IF_ERROR(AppendNeighbors(loader_->snapshot(), id, options_, &tried_, &round));
      extended_count_ += static_cast<uint32_t>(round.size() - before);
    }
    leads_.clear();
    return round;
  }

  NeighborSearch Take() {
    std::stable_sort(failed_.begin(), failed_.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (const auto& [inliers, id] : failed_) search_.promising.push_back({id, 0});
    const auto other = [&](const PairRecord& pair) {
      return pair.a == photo_.id ? pair.b : pair.a;
    };
    std::sort(search_.pairs.begin(), search_.pairs.end(),
              [&](const PairRecord& x, const PairRecord& y) { return other(x) < other(y); });
    return std::move(search_);
  }

 private:
  const ImageFeatures& photo_;
  MapLoader* const loader_;
  const NeighborOptions& options_;
  std::set<ImageId> tried_;
  std::vector<ImageId> leads_;  // images whose neighbours the next round tries
  uint32_t extended_count_ = 0;
  std::vector<std::pair<uint32_t, ImageId>> failed_;  // by how many matches were consistent
  NeighborSearch search_;
};

}  // namespace

Status NeighborOptions::Check() const {
  return OptionBounds()
      .Part("pair", pair.Check())
      .AtLeast("extended_per_image_max", extended_per_image_max, 1)
      .status();
}

bool IsCandidateDamaged(const Status& status) {
  return status.code() == StatusCode::kCorruption || status.code() == StatusCode::kNotFound;
}

Result<NeighborSearch> FindNeighbors(const ImageFeatures& photo,
                                     std::span<const RankedImage> candidates, uint64_t seed,
                                     MapLoader* loader, const CityMap& map, ThreadPool* pool,
                                     const NeighborOptions& options) {
  Finder finder(photo, loader, options);
  std::vector<ImageId> round = finder.FirstRound(candidates);
  while (!round.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(round, finder.LoadSound(round));
    std::vector<Result<PairVerification>> verified = finder.Verify(round, map, seed, pool);
    for (size_t i = 0; i < round.size(); ++i) {
      if (IsCandidateDamaged(verified[i].status())) {
        finder.PassOver(round[i], verified[i].status().message());
        continue;
      }
      if (!verified[i].ok()) return verified[i].status();
      finder.Note(round[i], std::move(*verified[i]));
    }
    VEDUTA_ASSIGN_OR_RETURN(round, finder.NextRound());
  }
  return finder.Take();
}

void JoinSearches(ImageId photo, NeighborSearch found, NeighborSearch* search) {
  std::map<ImageId, PairRecord> pairs;
  for (std::vector<PairRecord>* some : {&search->pairs, &found.pairs}) {
    for (PairRecord& pair : *some) {
      PairRecord& best = pairs[pair.a == photo ? pair.b : pair.a];
      if (pair.matches.size() > best.matches.size()) best = std::move(pair);
    }
  }
  search->pairs.clear();
  for (auto& [other, pair] : pairs) search->pairs.push_back(std::move(pair));
  if (search->tried_count == 0) search->tried_count = found.tried_count;
  if (found.best_inlier_count >= search->best_inlier_count && found.best_failed.valid()) {
    search->best_inlier_count = found.best_inlier_count;
    search->best_failed = found.best_failed;
  }
  search->promising = std::move(found.promising);
  search->damaged.merge(found.damaged);
}

}  // namespace veduta
