// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the city answers. Every answer owns what it holds. All of one Questions object are read from
// one commit, which Questions::snapshot() and `snapshot` name; a later commit's is greater.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/door/dense.h"
#include "engine/door/earth.h"
#include "engine/door/submission.h"
#include "storage/base/ids.h"
#include "storage/model/camera.h"
#include "storage/model/taken_time.h"
#include "storage/model/verdict.h"

namespace veduta {

// A pose without a library's types. x_cam = R(rotation_wxyz) x_world + translation.
struct PlainPose {
  std::array<double, 4> rotation_wxyz = {1, 0, 0, 0};  // unit quaternion of cam_from_world
  std::array<double, 3> translation = {0, 0, 0};       // of cam_from_world, world units
  std::array<double, 3> center = {0, 0, 0};            // the camera in the world
};

struct ReconstructionAnswer {
  ReconstructionId id;
  uint32_t images = 0;
  uint64_t points = 0, observations = 0;
  double reprojection_error_px_mean = 0;
  uint64_t geometry_version = 0;  // grows whenever a pose or a point of it moves
  ReconstructionId merged_into;   // valid once it was merged away
  bool dissolved = false;         // all its images have lost their poses
  double merged_scale = 1;        // x_into = merged_scale R x_this + translation; with
  PlainPose merged_pose;          // R and the translation of `merged_pose` (its center is unset)
  uint64_t depth_maps = 0, tiles = 0, triangles = 0;  // what the dense pass has made of it
};

// A merge of two reconstructions that is proposed and not believed yet. "For" and "against" are
// counted over the seam between the two.
struct HypothesisAnswer {
  ReconstructionId a, b;                          // a < b
  std::string reason;                             // why it is not believed, for a person
  uint32_t common_points = 0;                     // that agree; 0 where they are too few by now
  uint32_t pairs_for = 0, pairs_against = 0;      // verified pairs of photos
  uint64_t matches_for = 0, matches_against = 0;  // of these pairs, each as far as it counts
  // Parts of pictures that were asked for what they must show, and those that lack it.
  uint32_t parts_judged = 0, parts_missing = 0;
  bool is_open = false;  // no similarity is known: the next two mean nothing
  double scale = 1;      // x_a = scale R x_b + translation; with
  PlainPose pose;        // R and the translation of `pose` (its center is unset)
  ImageId image;         // whose placing proposed it first; not valid() where it was removed since
  std::vector<ImageId> unsure;  // images that may stand on either side; ascending
  uint32_t judgments = 0;       // how often it was judged
  bool due = false;             // it is to be judged anew
  int64_t time_unix_s = 0;      // of the last judgment
};

struct VerifyRequest {
  uint32_t count_max = 1000;  // >= 1; of violations that are told
  // Also compares the checksums of all files, and derives again what can be derived from photos:
  // their sizes, features and words.
  bool deep = false;

  Status Check() const;  // the first violated bound, named with its value
};

// What this process has written to the database's files and read from them since it opened it, in
// bytes; storage/database.h says what each is.
struct StorageAnswer {
  uint64_t log_bytes = 0, flush_bytes = 0, compaction_bytes = 0;  // together all that was written
  uint64_t blob_bytes = 0, blob_copied_bytes = 0;                 // parts of that
  uint64_t cache_hits = 0, cache_misses = 0;                      // of blocks of tables
};

// Doubtful seams that a status lists. Chosen by hand: a screenful.
inline constexpr size_t kDoubtfulSeamsMax = 20;

struct StatusAnswer {
  uint64_t snapshot = 0;
  uint64_t images = 0, placed = 0, postponed = 0, rejected = 0;
  uint64_t unsure = 0;                 // of the placed ones: ImageAnswer::may_stand_in
  uint64_t cameras = 0, uploads = 0;   // uploads: photos that wait for their turn
  uint64_t backlog = 0;                // images that are still to be tried again
  uint32_t vocabulary_generation = 0;  // 0: none yet
  std::vector<ReconstructionAnswer> reconstructions;  // living ones; most images first, then ids
  uint64_t open_hypotheses = 0;
  // Of those the ones with most common points, at most kDoubtfulSeamsMax; then ascending ids.
  std::vector<HypothesisAnswer> doubtful_seams;
  uint64_t total_bytes = 0, photo_bytes = 0, feature_bytes = 0;  // on disk
  StorageAnswer storage;
};

struct NeighborAnswer {
  ImageId image;
  std::string name;
  Verdict verdict = Verdict::kPostponed;
  uint32_t matches = 0;  // verified; 0 for a ranked candidate
  double score = 0;      // similarity of a ranked candidate; 0 for a verified neighbour
};

// How sure a pose is, given where the other images are: their poses are held, and points are known
// only as well as they are seen. It does not tell how far a large reconstruction has drifted, and
// it means nothing where the pose is wrong, rather than inexact.
struct PoseUncertainty {
  // Of (omega, d), row by row: the true rotation is exp([omega]x) R with the R of the pose, omega a
  // rotation vector in the camera's frame (x to the right, y down, z forward) in radians; the true
  // centre is center + d, along the world's axes, in world units.
  std::array<std::array<double, 6>, 6> covariance{};
  double rotation_stddev_deg = 0;  // root of the expected squared angle, of all three axes together
  double center_stddev = 0;        // root of the expected squared distance, world units
  double error_px = 0;       // standard deviation of features along each axis that this rests on
  uint32_t points = 0;       // that the image sees
  uint32_t images_held = 0;  // others that see one of them
};

struct ImageAnswer {
  uint64_t snapshot = 0;
  ImageId id;
  std::string name;
  Verdict verdict = Verdict::kRejected;
  Reason reason = Reason::kNone;
  std::string detail;
  ReconstructionId reconstruction;  // valid if it has a pose
  // Reconstructions in which it may stand as well, for places look alike there; ascending. Its own
  // is among them where it may stand elsewhere in that. Then no pose is told, and exports leave it
  // out, until it is sure.
  std::vector<ReconstructionId> may_stand_in;
  std::optional<PlainPose> cam_from_world;
  std::optional<EarthPose> on_earth;  // where it has a pose, and its reconstruction a place
  std::optional<GpsFix> gps;          // what the photo says of where it was taken
  std::optional<TakenTime> taken;     // and of when
  uint32_t contribution = 0;          // that it came with; 0: with none, or not noted
  bool is_hidden = false;             // a curator has hidden it; told to those alone who see it
  CameraId camera;
  uint32_t width_px = 0, height_px = 0, orientation = 0;  // as ImageRecord has them
  uint64_t size_bytes = 0;
  std::string sha256;  // of the photo's bytes, in hexadecimal
  std::string contributor;
  int64_t time_unix_s = 0;
  uint32_t features = 0, observations = 0;  // observations: features that see a point
  std::vector<NeighborAnswer> neighbors;    // verified ones, most matches first
  std::optional<DepthMapAnswer> depth_map;
  std::vector<HypothesisAnswer> hypotheses;  // of its reconstruction; ascending ids
  // Left empty by Questions::Image: Questions::Uncertainty computes it.
  std::optional<PoseUncertainty> uncertainty;
};

// One of many images: what is drawn of each.
struct ListedImage {
  ImageId id;
  std::string name, contributor;
  Verdict verdict = Verdict::kRejected;
  ReconstructionId reconstruction;  // valid if it has a pose
  bool is_unsure = false;           // ImageAnswer::may_stand_in; no pose is told then
  bool is_hidden = false;           // ImageAnswer::is_hidden
  uint32_t orientation = 0;         // ImageAnswer::orientation
  std::optional<PlainPose> cam_from_world;
};

// The sparse points, as many positions as colours; each beginning is an even sample of them.
struct PointCloud {
  uint64_t geometry_version = 0;
  std::vector<std::array<float, 3>> positions;  // world
  std::vector<std::array<uint8_t, 3>> rgb;      // sRGB
};

// A photo that is asked about and not added.
struct LocalizeRequest {
  PhotoSource photo;   // its path, or its bytes, must be given
  std::string camera;  // the name of a camera of the database; empty: unknown, to be estimated
  // A stored photo and a place, whatever its height, near which it was taken: sought there first.
  std::string near = {};
  std::optional<GeoPosition> near_place = {};

  Status Check() const;  // the first violated bound, named with its value
};

// A camera that was estimated from one photo, with standard deviations.
struct EstimatedCamera {
  CameraModel model;
  double focal_stddev_share = 0;  // of the focal length, over itself
  double k1_stddev = 0, k2_stddev = 0;
};

// An image that a pose rests on.
struct SupportAnswer {
  ImageId image;
  std::string name;
  uint32_t points = 0;  // that both see
};

// Where a photo was taken that was asked about and not added.
struct LocalizedPhoto {
  std::string name;
  Verdict verdict = Verdict::kRejected;  // kPlaced, kPostponed (no pose is believed) or kRejected
  Reason reason = Reason::kNone;
  std::string detail;               // the reason's numbers, for a person
  ImageId stored;                   // valid where the same bytes are stored: as this image
  ReconstructionId reconstruction;  // valid if placed; in its frame, which the photo has not moved,
  std::optional<PlainPose> cam_from_world;
  std::optional<EarthPose> on_earth;  // where that reconstruction has a place
  // Among the images around, whose poses are as uncertain: of their common frame, so none is held.
  // Nothing where too little is seen to tell.
  std::optional<PoseUncertainty> uncertainty;
  // Where the request named no camera, and a pose was found; nothing for a photo that is stored.
  std::optional<EstimatedCamera> camera;
  uint32_t inlier_count = 0;           // of the pose, or of the best pair when not placed
  std::vector<SupportAnswer> support;  // images that share points with it, most points first
  uint32_t neighbor_count = 0, pairs_tried = 0;
  // Stored images that the photo was not compared with, because they are damaged; ascending.
  std::vector<DamagedImage> damaged;
  StepTimes times;
  // Not Ok: the photo was not judged, for a reason that says nothing about it, as in AddOutcome.
  veduta::Status failure;
};

struct VocabularyAnswer {
  uint64_t snapshot = 0;
  uint32_t generation = 0;
  uint32_t branch = 0, depth = 0;
  uint64_t words = 0, training_descriptors = 0;
  uint32_t images_at_training = 0;
  bool imported = false;
};

struct JournalAnswer {
  uint64_t sequence = 0;
  int64_t time_unix_s = 0;
  std::string actor, action;
  ImageId image;                    // valid where it is about one
  ReconstructionId reconstruction;  // valid where it is about one
  std::string detail;
};

// "a clause: its numbers", as a person reads it.
std::string VerdictWord(Verdict verdict);
std::string ReasonSentence(Reason reason, const std::string& detail);

}  // namespace veduta
