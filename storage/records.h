// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values that the database keeps, as plain C++ structs. How they lie in bytes:
// storage/FORMAT.md. Pixels: the centre of the top-left pixel is (0, 0). Camera frame: x right, y
// down, z forward.

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"
#include "storage/base/transform.h"

namespace veduta {

inline constexpr int kDescriptorSize = 128;  // bytes a SIFT descriptor takes, one a bin

// Pinhole with the paper's radial distortion about its own centre. All in px of the (upright)
// photo; k1 and k2 in normalised coordinates: x_d = c + (x - c)(1 + k1 r^2 + k2 r^4), r = |x - c|,
// c = ((u0 - cx) / fx, (v0 - cy) / fy).
struct CameraModel {
  uint32_t width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0;
  double u0 = 0, v0 = 0;  // centre of distortion; equals (cx, cy) unless said otherwise

  bool operator==(const CameraModel&) const = default;
};

struct CameraRecord {
  CameraId id;
  std::string name;
  CameraModel model;
  std::string source;  // where the intrinsics came from, in words
};

// One SIFT feature of the undistorted image.
struct Keypoint {
  float x_px = 0, y_px = 0;
  float scale_px = 0;   // sigma of the Gaussian at which it was found
  float angle_deg = 0;  // dominant gradient orientation, [0, 360)
  float response = 0;   // |DoG|, the strength that features are ranked by
  int8_t contrast_sign =
      0;  // sign of the Laplacian: +1 dark blob on bright ground, -1 bright on dark
  std::array<uint8_t, 3> rgb{};

  bool operator==(const Keypoint&) const = default;
};

// The features of one photo, strongest response first.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<uint8_t> descriptors;  // [keypoints.size() x 128], row-major

  size_t size() const { return keypoints.size(); }
  const uint8_t* descriptor(size_t i) const { return descriptors.data() + i * kDescriptorSize; }
};

// Values are stored: append only, never renumber.
enum class Verdict : uint8_t {
  kPlaced = 1,
  kMerged = 2,
  kFounded = 3,
  kPostponed = 4,
  kRejected = 5
};

enum class Reason : uint8_t {
  kNone = 0,
  // why a photo is where it is
  kRegistered = 1,  // placed in one reconstruction
  kJoinedReconstructions = 2,
  kGoodTriple = 3,  // founded a reconstruction with two other views
  kPropagated = 4,  // placed when a neighbour was
  // why it is postponed
  kNoCandidates = 20,           // nothing in the database looks like it
  kNoVerifiedNeighbor = 21,     // candidates failed the geometric check
  kTooFewStructurePoints = 22,  // neighbours are placed, but too few of their points are seen
  kResectionFailed = 23,        // points are seen, but no pose explains enough of them
  kNoGoodTriple = 24,           // neighbours are not placed, and no three views make a sound start
  kContradictsNeighbors = 25,   // the pose found disagrees with other verified neighbours
  kTooFewFeatures = 26,
  // why it is rejected
  kUnreadable = 40,
  kUnsupportedFormat = 41,
  kTooLarge = 42,
  kWrongSize = 43,
  kNoTexture = 44,  // black, white or out of focus: no features to speak of
  kEmptyFile = 45,
  kNameTaken = 46,  // other content is stored under this name
};

struct ImageRecord {
  ImageId id;
  std::string name;  // unique; the path relative to the folder given
  ContentHash photo;
  CameraId camera;
  uint32_t width_px = 0, height_px = 0;
  uint64_t size_bytes = 0;
  uint32_t feature_count = 0;
  std::string contributor;
  int64_t time_unix_s = 0;  // when it was applied; not part of the digest
  Verdict verdict = Verdict::kRejected;
  Reason reason = Reason::kNone;
  std::string detail;  // the reason with its numbers, for a person
};

enum class PairGeometry : uint8_t {
  kGeneral = 1,   // an essential matrix that no homography explains as well
  kPlanar = 2,    // a homography explains the matches: a plane seen with parallax
  kRotation = 3,  // a rotation explains the matches: no parallax, no structure
};

struct FeatureMatch {
  FeatureIndex a = 0, b = 0;
  bool operator==(const FeatureMatch&) const = default;
};

// An edge of the view graph: a < b always.
struct PairRecord {
  ImageId a, b;
  PairGeometry geometry = PairGeometry::kGeneral;
  Rigid3 b_from_a;                    // translation of unit length
  std::vector<FeatureMatch> matches;  // verified inliers, ascending in a, each feature at most once
};

struct PairNeighbor {
  ImageId image;
  uint32_t match_count = 0;
  PairGeometry geometry = PairGeometry::kGeneral;
};

struct ReconstructionRecord {
  ReconstructionId id;
  ReconstructionId merged_into;  // valid once it has been merged away
  Sim3 merged_from_this;         // merged_into's frame from this one's
  uint32_t image_count = 0;
  uint64_t point_count = 0;
  uint64_t observation_count = 0;
  double reprojection_error_px_sum = 0;  // over observations
  uint64_t geometry_version = 0;         // grows whenever a pose or point of it moves
  uint32_t points_generation = 0;        // which generation of point blocks is current
  uint32_t images_at_adjustment = 0;     // image_count when all of it was last adjusted
};

struct PoseRecord {
  ImageId image;
  ReconstructionId reconstruction;
  Rigid3 cam_from_world;
};

struct Observation {
  FeatureIndex feature = 0;
  PointId point;
  bool operator==(const Observation&) const = default;
};

struct TrackElement {
  ImageId image;
  FeatureIndex feature = 0;
  bool operator==(const TrackElement&) const = default;
};

struct PointRecord {
  PointId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<uint8_t, 3> rgb{};
  float error_px = 0;               // mean reprojection error
  std::vector<TrackElement> track;  // ascending images, each at most once; at least two
};

// All points that one image is home to: the unit in which points are read and written.
struct PointBlock {
  ImageId home;
  uint32_t next_ordinal = 1;        // ordinals are never used again
  std::vector<PointRecord> points;  // ascending ordinals
};

struct JournalRecord {
  uint64_t sequence = 0;
  int64_t time_unix_s = 0;
  std::string actor;   // the contributor, or "veduta"
  std::string action;  // add, propagate, adjust, merge, vocabulary, camera, densify
  ImageId image;
  ReconstructionId reconstruction;
  std::string detail;
};

}  // namespace veduta
