// SPDX-License-Identifier: Apache-2.0
#pragma once
// Applies prepared photos one after another, each as one transaction, and then whatever follows
// from it: postponed neighbours tried again, adjustment of a whole reconstruction, a new
// vocabulary. What follows is read from the database's state, so that a process killed anywhere
// goes on where it stopped.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/door/submission.h"
#include "engine/ingest/mapper.h"
#include "engine/ingest/neighbor_finder.h"
#include "engine/photo/photo_preparer.h"
#include "engine/retrieval/retrieval.h"

namespace veduta {

struct AdjustmentSchedule {
  uint32_t views_step = 15;  // >= 1; M in the paper's section 3.3
  double growth_share =
      0.10;  // > 0: of a reconstruction that is larger than views_step / growth_share
};

struct IngestOptions {
  RetrievalOptions retrieval;
  NeighborOptions neighbors;
  MapperOptions mapper;
  AdjustmentSchedule schedule;
  uint32_t map_images_max = 400;  // images kept in memory between photos
  size_t feature_cache_bytes = 768ull << 20;
  uint32_t matched_count_max = 1500;   // features of an image that are matched; R11
  uint32_t thorough_count_max = 4096;  // >= matched_count_max: of a photo that those do not place
  Status Check() const { return Status::Ok(); }
  uint32_t thorough_pairs_max = 10;  // images that it is then matched with
  uint32_t ample_match_count =
      250;  // a neighbour with so many verified matches makes that unnecessary
};

// The writer: one at a time, guarded by its owner. Not thread-safe.
class Ingest final {
 public:
  Ingest(Database* database, Retrieval* retrieval, ImageFeatureCache* features, ThreadPool* pool,
         IngestOptions options)
      : database_(database),
        retrieval_(retrieval),
        features_(features),
        pool_(pool),
        options_(std::move(options)) {}

  // Commits the photo with its verdict. An error means that nothing of it is visible.
  Result<AddOutcome> Apply(PreparedPhoto photo, const CameraRecord& camera,
                           const std::string& contributor);
  std::optional<FollowUp> RunNextStep();
  // Everything that is due after the last commit, each step a transaction of its own. Ids of images
  // that got a pose.
  Result<std::vector<ImageId>> FinishDue();

 private:
  // Finds the image's neighbours and places it by them. Where that fails, or no neighbour shares
  // much with it, once more by more features.
  Result<Placement> Locate(const ImageFeatures& image, const CameraModel& camera,
                           std::span<const RankedImage> candidates, const DatabaseState& state,
                           uint64_t seed, MapLoader* loader, NeighborSearch* search,
                           StepTimes* times);
  // Joins the neighbours among `candidates` to those that `search` holds.
  Status Search(const ImageFeatures& image, std::span<const RankedImage> candidates,
                const NeighborOptions& options, uint64_t seed, MapLoader* loader,
                NeighborSearch* search, StepTimes* times);
  Status SearchThoroughly(const ImageFeatures& wide, uint64_t seed, MapLoader* loader,
                          NeighborSearch* search, StepTimes* times);
  Result<Placement> Place(const ImageFeatures& image, const NeighborSearch& search,
                          const DatabaseState& state, uint64_t seed, MapLoader* loader,
                          StepTimes* times);
  Result<AddOutcome> StoreRejection(const PreparedPhoto& photo, const Snapshot& snapshot,
                                    ImageRecord record);
  // Writes what the mapper changed, the reconstruction records, and the photos to be tried again.
  Status WritePlacement(const Snapshot& snapshot, const Placement& placement, DatabaseState* state,
                        Transaction* transaction);
  Status WriteChanges(const Snapshot& snapshot, const Placement& placement,
                      Transaction* transaction);
  Status AppendRetries(const Snapshot& snapshot, std::span<const ImageId> placed,
                       DatabaseState* state);
  Result<std::vector<ImageId>> RetryNext(const DatabaseState& state);
  Result<bool> AdjustNext();
  bool IsAdjustmentDue(const ReconstructionRecord& record) const;
  // Drops the map when it has grown too large, or after a failure.
  void TrimMap();

  Database* database_;
  Retrieval* retrieval_;
  ImageFeatureCache* features_;
  ThreadPool* pool_;
  const IngestOptions options_;
  Map map_;
};

// One journal entry, numbered from the state.
void Journal(std::string actor, std::string action, ImageId image, ReconstructionId reconstruction,
             std::string detail, DatabaseState* state, Transaction* transaction);

}  // namespace veduta
