// SPDX-License-Identifier: Apache-2.0
#pragma once
// Brings stored images and points into the map in memory. The map doubles as a cache between
// photos: what is loaded and has not changed since equals the last commit.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>
#include <vector>

#include "engine/mapping/city_map.h"
#include "engine/photo/image_features.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// The image as a map holds it, without a pose and observing nothing.
MapImage UnplacedImage(const ImageFeatures& features);

// Loads from one snapshot. What is in the map already is not loaded again. A pose, observation or
// block that contradicts another record is kCorruption, naming the image. Not thread-safe.
class MapLoader final {
 public:
  // Records are read on all threads of the pool, if there is one.
  MapLoader(std::shared_ptr<const Snapshot> snapshot, ImageFeatureCache* features, CityMap* map,
            ThreadPool* pool = nullptr)
      : snapshot_(std::move(snapshot)), features_(features), map_(map), pool_(pool) {}

  // Loads those of the images that have a pose (and have not lost it in the map), and the points
  // that their features see.
  Status LoadImages(std::span<const ImageId> images);
  // These images, and the blocks of the points that they see.
  Status LoadStructure(std::span<const ImageId> images);
  // What LoadStructure loads, and every image in the tracks of those points and their homes: all
  // that a change of these images may touch.
  Status LoadNeighborhood(std::span<const ImageId> images);
  // What LoadNeighborhood loads of one image, and what sees the points that it is home to: all that
  // taking its pose away may touch.
  Status LoadToUnplace(ImageId image);
  // A whole reconstruction with its surroundings. `images` receives its members, ascending. Scans
  // all poses of the database.
  Status LoadReconstruction(ReconstructionId id, std::vector<ImageId>* images);

  // A stored pair whose matches name features that both images have: kCorruption otherwise.
  // Thread-safe while nothing is loaded and nobody changes the map.
  Result<PairRecord> GetPair(ImageId a, ImageId b) const;
  // The record as it is stored; read once.
  Result<ReconstructionRecord> GetReconstruction(ReconstructionId id);
  const Snapshot& snapshot() const { return *snapshot_; }
  ImageFeatureCache* features() const { return features_; }

 private:
  // Whether the map does not hold the image, and has not taken its pose since it was stored.
  bool IsToLoad(ImageId id) const;
  // Nothing where the image has no pose. Thread-safe.
  Result<std::optional<MapImage>> ReadImage(ImageId id) const;
  // Those of the images whose neighbourhood is not known to be in the map.
  std::vector<ImageId> WithoutNeighborhood(std::span<const ImageId> images);
  // body(0..count-1) on all threads there are.
  void ForEach(size_t count, const std::function<void(size_t)>& body) const;
  Result<uint32_t> CountFeatures(ImageId id) const;
  Status LoadBlocks(std::span<const ImageId> homes);
  // Where the points of the image are stored. kCorruption where it has no pose.
  Result<ReconstructionRecord> HomeOf(ImageId image);
  // The images that see what these see, and those at which these points are at home; ascending.
  std::vector<ImageId> ListAround(std::span<const ImageId> images) const;
  // Checks that what these images see agrees with the other records that name it: these are the
  // first invariants of CityMap, on which all that changes the map relies.
  Status CheckSeen(std::span<const ImageId> images);
  Status CheckSeenBy(const MapImage& image) const;

  std::shared_ptr<const Snapshot> snapshot_;
  ImageFeatureCache* features_;
  CityMap* map_;
  ThreadPool* pool_;
  bool has_loaded_ = false;                    // something since the last CheckSeen
  std::unordered_set<ImageId> checked_;        // of these CheckSeen was content
  std::unordered_set<ImageId> neighborhoods_;  // that are in the map, while edit_count_ is its own
  uint64_t edit_count_ = 0;
  std::map<ReconstructionId, ReconstructionRecord> reconstructions_;
};

}  // namespace veduta
