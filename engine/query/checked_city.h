// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the checks of one subject know of the others, and the checks themselves, one for each
// subject. All of them run on one snapshot, in any order after LoadCity. What cannot be read is a
// violation and is missing from then on, so one damaged record may break several checks.

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "engine/photo/photo_preparer.h"
#include "engine/query/violations.h"
#include "storage/base/lru_cache.h"
#include "storage/database.h"
#include "storage/model/pinhole.h"

namespace veduta {

// Where the features of one image lie, px.
using KeypointPlaces = std::vector<Eigen::Vector2f>;

struct CheckedCity {
  CheckedCity(const Snapshot& of, bool is_deep, const PhotoPreparer* prepares)
      : snapshot(of), deep(is_deep), preparer(prepares) {}

  const Snapshot& snapshot;
  const bool deep;                      // derive again what can be derived, however long it takes
  const PhotoPreparer* const preparer;  // with it, features too; may be null

  DatabaseState state;
  std::vector<ForbiddenRecord> forbidden;
  std::vector<HypothesisRecord> hypotheses;
  std::vector<SubmapRecord> submaps;
  std::set<SubmapId> borders;
  std::vector<GroundPoint> ground_points;
  std::map<CameraId, CameraRecord> cameras;
  std::map<ImageId, ImageRecord> images;
  std::map<ReconstructionId, ReconstructionRecord> reconstructions;
  std::map<ImageId, PoseRecord> poses;
  // What marks of the queue name: half-written, and no violation.
  std::set<ContentHash> photos_ahead;
  std::set<std::pair<ReconstructionId, uint32_t>> points_ahead;
  std::set<uint32_t> vocabularies_ahead;
  std::map<ContentHash, ImageId> sealed;  // images by the hashes of what was sealed of them

  // Whether the image exists and has features.
  bool HasFeatures(ImageId id) const;
  uint32_t FeatureCount(ImageId id) const;  // 0 where it has none
  // Null where image, camera or features are missing or damaged. Kept for the next time.
  struct Eye {
    Pinhole camera;
    CameraModel extraction;    // CameraRecord::extraction_model
    KeypointPlaces keypoints;  // where the camera has them
    KeypointPlaces extracted;  // where `extraction` has them; empty where that is no other place

    const KeypointPlaces& places_extracted() const {
      return extracted.empty() ? keypoints : extracted;
    }
  };
  std::shared_ptr<const Eye> EyeOf(ImageId id) const;

 private:
  // 256 MiB, of which an image takes 8 bytes for each feature. Chosen by hand; not measured.
  mutable LruCache<ImageId, std::shared_ptr<const Eye>> eyes_{256 << 20};
};

// What `verify` asks of one pair, and of the error that a point records: engine/repair asks the
// same. Features that are missing or damaged are no violation here. CheckPair refines the pair's
// geometry, which takes time linear in its matches.
void CheckPair(const CheckedCity& city, const PairRecord& pair, Violations* violations);
// How far a point is seen from where its position and `poses` put it, px, on the average of its
// track; none where a pose or a feature of the track is missing or damaged.
std::optional<double> MeasureErrorPx(const CheckedCity& city,
                                     const std::map<ImageId, PoseRecord>& poses,
                                     const PointRecord& point);
// Whether the error that the point records is the one that was measured.
bool IsErrorRecorded(const PointRecord& point, double error_px);

// State, what is forbidden, hypotheses, marks, and the small records: cameras, images,
// reconstructions, poses.
Status LoadCity(CheckedCity* city, Violations* violations);

// Counters of the state; names, hashes, photos and features of images; their cameras.
Status CheckImages(const CheckedCity& city, Violations* violations);
// What the journal tells of images, cameras, reconstructions and the vocabulary.
Status CheckJournal(const CheckedCity& city, Violations* violations);
// Verified pairs of images: both directions, and the matches against the geometry.
Status CheckPairs(const CheckedCity& city, Violations* violations);
// Reconstructions, poses, points and observations; points against what is seen of them.
Status CheckStructure(const CheckedCity& city, Violations* violations);
// The tree, the words of images and the images of words.
Status CheckVocabulary(const CheckedCity& city, Violations* violations);
// Photos that wait for their turn, or arrive in parts: reads all of them.
Status CheckUploads(const CheckedCity& city, Violations* violations);
// Photos that were sent together.
Status CheckContributions(const CheckedCity& city, Violations* violations);

}  // namespace veduta
