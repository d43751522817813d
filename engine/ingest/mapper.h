// SPDX-License-Identifier: Apache-2.0
#pragma once
// Decides which of the four cases of the paper's section 3.3 a photo is, and carries it out on the
// Map.

#include <span>
#include <string>
#include <vector>

#include "engine/ingest/map_loader.h"
#include "engine/ingest/merge_candidates.h"
#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/founding.h"
#include "engine/mapping/growth.h"
#include "engine/mapping/placement.h"
#include "engine/mapping/point_filter.h"
#include "engine/mapping/resection.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct MapperOptions {
  ResectionOptions resection;
  double putative_ratio_max = 0.88;  // (0, 1]: of matches by which a pose is sought
  uint32_t neighbor_match_count_min =
      100;  // verified with one placed image, which then may lead to the pose
  ResectionOptions along_neighbor = {.inlier_count_min = 10, .inlier_share_min = 0.35};
  uint32_t sure_inlier_count =
      60;  // a pose by fewer points gives way to founding with unplaced neighbours
  uint32_t weak_inlier_count_min =
      30;  // such a pose is taken, where nothing is founded, from so many points
  double weak_inlier_share_min = 0.5;  // [0, 1]: and such a share of those seen
  double neighbor_error_px_max =
      6.0;  // > 0: distance from the epipolar line that still agrees with a pose
  double contradiction_share_max =
      0.5;  // > 0: contradicting over agreeing matches; above, the photo is postponed
  uint32_t local_images_max = 12;    // >= 2: images whose poses a new photo may move
  uint32_t settled_images_max = 4;   // >= 2: likewise, before it is matched along known geometry
  uint32_t guided_images_max = 8;    // images that a new one is matched with along known geometry
  uint32_t observations_min = 20;    // of a placed image, after adjustment
  uint32_t common_points_min = 20;   // >= 3: of a merge; R13
  double merge_error_px_max = 6.0;   // > 0
  uint32_t founding_views_max = 12;  // >= 3
  GrowthOptions growth;
  // Later photos adjust again what a step leaves undone.
  BundleOptions local_bundle = {.iterations_max = 4, .function_tolerance = 1e-4};
  BundleOptions global_bundle = {.iterations_max = 15, .function_tolerance = 1e-4};
  PointFilterOptions filter;
  FoundingOptions founding;
};

struct Merge {
  ReconstructionId from;
  Sim3 into_from;
  uint32_t common_point_count = 0;
};

struct Placement {
  Verdict verdict = Verdict::kPostponed;
  Reason reason = Reason::kNone;
  std::string detail;
  ReconstructionId reconstruction;  // valid unless postponed
  ReconstructionId founded;         // valid if one was founded, also if it was merged at once
  std::vector<ImageId>
      placed;  // images that got a pose: the photo first, then the triple it founded with
  std::vector<Merge> merges;
  uint32_t inlier_count = 0;
  double map_ms = 0, adjust_ms = 0;
};

class Mapper final {
 public:
  Mapper(MapLoader* loader, Map* map, ThreadPool* pool, const MapperOptions& options)
      : loader_(loader), map_(map), pool_(pool), options_(options) {}

  // Places a photo by its verified pairs. `new_reconstruction` is the id that a founded one takes;
  // not valid(): the photo may not found one. When the photo is postponed, the map's contents are
  // as before or cleared.
  Result<Placement> Place(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                          ReconstructionId new_reconstruction, uint64_t seed);

  // Completes tracks, adjusts all poses and points of a reconstruction and filters, twice. All of
  // it gets loaded.
  Status AdjustReconstruction(ReconstructionId id);

 private:
  struct Candidate {
    ReconstructionId reconstruction;
    Resection resection;
    StructureMatches structure;
    ImageId along;      // the neighbour whose geometry led to the pose, or not valid()
    bool weak = false;  // see IsWeak
  };

  // The mutual neighbours, right or wrong, of the photo with those of the pairs' images that are
  // placed: a pair's own geometry may have chosen, among repeated windows, what the pose by all of
  // them does not.
  Result<std::vector<PairMatches>> MatchAgain(const ImageFeatures& photo,
                                              std::span<const PairMatches> pairs);
  std::vector<Candidate> FindPlacements(const ImageFeatures& photo,
                                        std::span<const PairMatches> pairs,
                                        std::span<const PairMatches> putative, uint64_t seed,
                                        Placement* placement);
  // Where the points alone give no pose, one by the neighbour with most matches and the points
  // together.
  void ResectAlongNeighbor(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                           Candidate* candidate) const;
  bool IsWeak(size_t inlier_count, std::span<const PairMatches> pairs) const;
  // Looks for better poses of placed images by all that is there now, and moves those that have
  // one.
  Status ReconsiderPoses(std::span<const ImageId> images);
  void PlaceInto(const ImageFeatures& photo, std::span<const PairMatches> putative,
                 const Candidate& candidate);
  // Merges the reconstructions that verified pairs of `near` images lead to, where their common
  // points agree. The one that is published longer, of more images, keeps its frame.
  Status TryMerges(std::span<const ImageId> near, std::span<const PairMatches> pairs, uint64_t seed,
                   Placement* placement);
  Result<bool> TryMerge(std::span<const PointPair> common, ReconstructionId other, uint64_t seed,
                        Placement* placement);
  Status TryFound(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                  ReconstructionId id, uint64_t seed, Placement* placement);
  // Matches the image with those around it along the lines that their poses give, projects what
  // they see into it, and what it sees into them.
  Status GrowAround(ImageId image);
  Status AdjustAround(ImageId image, size_t images_max);
  // Images that share points with it, most first.
  std::vector<ImageId> CovisibleImages(ImageId image, size_t count_max) const;

  MapLoader* loader_;
  Map* map_;
  ThreadPool* pool_;
  const MapperOptions& options_;
};

}  // namespace veduta
