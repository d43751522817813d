// SPDX-License-Identifier: Apache-2.0
#pragma once
// Brings stored images and points into a Map, and writes a Map's changes into a transaction. The
// Map doubles as the ingest engine's cache: what is loaded and unchanged equals the last commit.

#include <map>
#include <memory>
#include <span>

#include "engine/mapping/map.h"
#include "engine/photo/image_features.h"
#include "storage/database.h"

namespace veduta {

class MapLoader final {
 public:
  MapLoader(std::shared_ptr<const Snapshot> snapshot, ImageFeatureCache* features, Map* map)
      : snapshot_(std::move(snapshot)), features_(features), map_(map) {}

  // Those of the images that have a pose and are not loaded yet.
  Status LoadImages(std::span<const ImageId> images);
  // The images and the points they see.
  Status LoadStructure(std::span<const ImageId> images);
  // That, and every image in the tracks of those points and their homes: what may be changed.
  Status LoadNeighborhood(std::span<const ImageId> images);
  // All of it. `images` receives its members, ascending.
  Status LoadReconstruction(ReconstructionId id, std::vector<ImageId>* images);

  // The record as stored; cached.
  Result<ReconstructionRecord> GetReconstruction(ReconstructionId id);
  const Snapshot& snapshot() const { return *snapshot_; }
  ImageFeatureCache* features() const { return features_; }

 private:
  Status LoadBlocks(std::span<const ImageId> homes);

  std::shared_ptr<const Snapshot> snapshot_;
  ImageFeatureCache* features_;
  Map* map_;
  std::map<ReconstructionId, ReconstructionRecord> reconstructions_;
};

std::vector<Observation> ObservationsOf(const MapImage& image);

}  // namespace veduta
