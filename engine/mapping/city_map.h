// SPDX-License-Identifier: Apache-2.0
#pragma once
// The part of the city that is being worked on, in memory: poses, points and tracks, with a record
// of what has changed. It knows nothing of storage: its owner loads images and point blocks into it
// before an algorithm needs them, and writes the changes out afterwards. Every function keeps these
// invariants:
//   1. image.points[f] == p exactly when the track of p holds (image, f), as far as both are
//      loaded.
//   2. The track of a point that exists has two or more elements, in ascending images, at most one
//      for each image, and all its images are in one reconstruction.
//   3. A point lies in the block of its home image, and the blocks and images of one reconstruction
//      share its frame. Iteration is always in ascending ids, so that results do not depend on the
//      history of loading. Not thread-safe; const functions may run in parallel.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "engine/mapping/image_table.h"
#include "engine/mapping/triangulation.h"
#include "engine/matching/feature_grid.h"
#include "storage/base/transform.h"
#include "storage/model/features.h"
#include "storage/model/pinhole.h"
#include "storage/model/points.h"

namespace veduta {

struct MapImage {
  ImageId id;
  ReconstructionId reconstruction;
  Rigid3 cam_from_world;
  Pinhole camera;
  uint32_t width_px = 0, height_px = 0;
  std::shared_ptr<const Features> features;
  std::shared_ptr<const FeatureGrid> grid;  // of the same features
  std::vector<PointId> points;              // [features.size()]; not valid() where there is none

  Sighting ViewOf(FeatureIndex feature) const {
    const Keypoint& k = features->keypoints[feature];
    return {cam_from_world, camera, {k.x_px, k.y_px}};
  }
};

// What a reconstruction's counts grew by since the last ClearChanges.
struct CountChange {
  int64_t points = 0, observations = 0;
  double reprojection_error_px_sum = 0;
};

struct CityMapChanges {
  std::map<ImageId, ReconstructionId> unplaced;  // that lost their pose, and where they had it
  std::set<ImageId> poses;                       // whose poses are new or moved
  std::set<ImageId> observations;                // whose features got or lost points
  std::set<ImageId> blocks;                      // homes of points that are new, changed or gone
  std::map<ReconstructionId, CountChange> counts;
};

class CityMap {
 public:
  bool HasImage(ImageId id) const { return image_table_.Find(id) != nullptr; }
  const MapImage& image(ImageId id) const;
  const std::map<ImageId, MapImage>& images() const { return images_; }
  bool HasBlock(ImageId home) const { return block_table_.Find(home) != nullptr; }
  // The block's points as they would be stored; the block must be loaded.
  PointBlock StoredBlock(ImageId home) const;
  // Null when the point no longer exists or its block is not loaded.
  const PointRecord* FindPoint(PointId id) const;
  const PointRecord& point(PointId id) const;
  // The points that one of these loaded images observes and whose blocks are loaded; ascending,
  // each once. O(their features + the points of the blocks).
  std::vector<PointId> PointsSeenBy(std::span<const ImageId> images) const;
  // Views of a point from its loaded images.
  std::vector<Sighting> ViewsOf(const PointRecord& point) const;

  // Loading brings in stored state, so no change is recorded.
  void LoadImage(MapImage image);
  void LoadBlock(const PointBlock& block);

  // A newly placed image, observing nothing yet, with an empty block of its own.
  void PlaceImage(MapImage image);
  void SetPose(ImageId id, const Rigid3& cam_from_world);
  // The image has another lens, which has its features, as many as before, elsewhere. What it sees
  // is not measured anew.
  void SetLens(ImageId id, const Pinhole& camera, std::shared_ptr<const Features> features,
               std::shared_ptr<const FeatureGrid> grid);
  // The image loses its pose and is forgotten, with its observations. Points that it was home to
  // get another of their images as their home, the first, and so another name. Loaded must be all
  // that MapLoader::LoadToUnplace loads.
  void UnplaceImage(ImageId id);
  // The image, which must be loaded with all that MapLoader::LoadToUnplace loads, has another
  // picture of the same content from now on, with that one's camera and features; its pose stays.
  // What its feature a saw is seen by b, for each of the `counterparts` (a and b at most once);
  // other points lose its view.
  void ExchangePicture(MapImage with, std::span<const FeatureMatch> counterparts);
  // `track` in any order, two or more images of one reconstruction, whose features have no point
  // yet. The home must be one of the reconstruction's images.
  PointId AddPoint(ImageId home, const Eigen::Vector3d& position, std::vector<TrackElement> track);
  // The feature must have no point, and the point no feature of that image.
  void AddObservation(PointId id, TrackElement element);
  // Deletes the point when fewer than two elements remain.
  void RemoveObservation(PointId id, ImageId image);
  void RemovePoint(PointId id);
  // Moves the track of `drop` to `keep`. The two must not share an image.
  void MergePoints(PointId keep, PointId drop);
  bool SharesImage(const PointRecord& a, const PointRecord& b) const;
  // Also measures the mean reprojection error anew.
  void SetPosition(PointId id, const Eigen::Vector3d& position);
  // Carries a loaded image, or a loaded block's points, into another reconstruction's frame.
  void MoveImage(ImageId id, ReconstructionId into, const Sim3& into_from_old);
  void MoveBlock(ImageId home, ReconstructionId into, const Sim3& into_from_old);
  // Makes the loaded images that are given the only ones that see points together with each other:
  // every point that they and other images see keeps the views of the side that has more of them
  // (the given ones, where both have as many), and has its home there.
  void CutOff(const std::set<ImageId>& part);

  // Another number once any track has changed or an image is forgotten. Loading is no such change:
  // what is loaded stays as it is.
  uint64_t edit_count() const { return edit_count_; }

  const CityMapChanges& changes() const { return changes_; }
  void ClearChanges() { changes_ = {}; }
  void Clear();

 private:
  struct Block {
    std::vector<PointRecord> points;  // [ordinal - 1]; an empty track where none lives
  };

  Block& MakeBlock(ImageId home);
  MapImage& MutableImage(ImageId id);
  PointRecord& MutablePoint(PointId id);
  PointId MoveHome(PointId id, ImageId home);
  void CountPoint(const PointRecord& point, int sign);
  void Measure(PointRecord* point) const;

  std::map<ImageId, MapImage> images_;
  std::map<ImageId, Block> blocks_;
  ImageTable<MapImage> image_table_;  // of images_
  ImageTable<Block> block_table_;     // of blocks_
  CityMapChanges changes_;
  uint64_t edit_count_ = 0;
};

}  // namespace veduta
