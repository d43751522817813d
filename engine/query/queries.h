// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the city answers: every question on one snapshot, none waits for a writer.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/photo/image_features.h"
#include "engine/retrieval/retrieval.h"
#include "storage/database.h"

namespace veduta {

struct CityStatus {
  uint64_t images = 0, placed = 0, postponed = 0, rejected = 0;
  uint64_t cameras = 0, pairs = 0;
  uint64_t backlog = 0;  // postponed photos still to be tried again
  uint32_t vocabulary_generation = 0;
  std::vector<ReconstructionRecord>
      reconstructions;  // living ones, most images first, then ascending ids
};

class Queries {
 public:
  Queries(std::shared_ptr<const Snapshot> snapshot, Retrieval* retrieval,
          ImageFeatureCache* features)
      : snapshot_(std::move(snapshot)), retrieval_(retrieval), features_(features) {}

  const Snapshot& snapshot() const { return *snapshot_; }

  // O(images).
  Result<CityStatus> Status() const;
  // By name, or by "#" and its number. kNotFound names it.
  Result<ImageRecord> FindImage(const std::string& name) const;
  // Verified neighbours, most matches first.
  Result<std::vector<PairNeighbor>> Neighbors(ImageId image) const;
  Result<std::optional<PoseRecord>> Pose(ImageId image) const { return snapshot_->FindPose(image); }
  // Images that look most like the features: by the vocabulary, or, without one, by the share of
  // the query's features that have a mutual nearest neighbour passing the ratio test.
  Result<std::vector<RankedImage>> RankFeatures(const Features& features, uint32_t count_max,
                                                ThreadPool* pool) const;

 private:
  std::shared_ptr<const Snapshot> snapshot_;
  Retrieval* retrieval_;
  ImageFeatureCache* features_;
};

}  // namespace veduta
