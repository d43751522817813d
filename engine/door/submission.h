// SPDX-License-Identifier: Apache-2.0
#pragma once
// How photos come in, what is answered, how they go out again, what people forbid, and how the
// vocabulary is trained that finds them. Standard library and plain structs only.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"
#include "storage/model/verdict.h"

namespace veduta {

// A contributed file: read from `path`, unless the bytes are given, or what reads them.
struct PhotoSource {
  std::string name;  // in the database; unique among the photos of its contributor
  std::string path;
  std::optional<std::vector<uint8_t>> bytes;
  // Gives the bytes in place of a path. Called from any thread, and more than once.
  std::function<Result<std::vector<uint8_t>>()> read = {};
};

// A photo with the camera that took it and who sends it.
struct PhotoSubmission {
  PhotoSource photo;
  // The name of a camera of the database. Empty: it is that of other photos which tell the same of
  // themselves (EXIF), or estimated from how the photo fits into the city.
  std::string camera;
  std::string contributor;
  // Of a photo that waits on the disk (Engine::Submit): the number of an open contribution of the
  // same contributor that it is a part of; 0: of none.
  uint32_t contribution = 0;
};

// A camera that photos were calibrated by together (Engine::CalibrateFirst).
struct FirstCamera {
  uint32_t photos = 0;  // that say nothing against having been taken with it
  std::string name;     // in the database; empty where there is none
  std::string why_not;  // then: for a person
  CameraModel model;
  double focal_stddev_share = 0;  // standard deviation of the focal length over itself
};

// Wall time of each step of one photo, in milliseconds.
struct StepTimes {
  double decode_ms = 0, undistort_ms = 0, features_ms = 0, retrieve_ms = 0, match_ms = 0,
         verify_ms = 0, map_ms = 0, adjust_ms = 0, commit_ms = 0, follow_ms = 0, total_ms = 0;
  // The longest turn_ms of the steps that are in follow_ms: so long nobody else could write.
  double longest_step_ms = 0;
};

// A stored image that cannot be read.
struct DamagedImage {
  ImageId image;
  std::string what;  // for a person: family and key of what is damaged
};

// An image that lost its pose, for the evidence turned against it.
struct LostPose {
  ImageId image;
  std::string detail;  // where it was, and what spoke against it, for a person
};

// What became of one photo.
struct AddOutcome {
  std::string name;
  ImageId id;              // not valid() when nothing was stored
  bool duplicate = false;  // the bytes were there already; `detail` names the image
  bool replaced = false;   // a duplicate of more pixels: the image has its bytes from now on
  Verdict verdict = Verdict::kRejected;
  Reason reason = Reason::kNone;
  std::string detail;               // the reason's numbers, for a person
  ReconstructionId reconstruction;  // valid if placed
  std::string camera;               // that was found for it, where none was named
  uint32_t neighbor_count = 0, pairs_tried = 0;
  uint32_t inlier_count = 0;                // of the pose, or of the best pair when not placed
  std::vector<ImageId> propagated;          // earlier photos that got a pose in the same commit
  std::vector<LostPose> unplaced;           // that lost theirs by what followed from the photo
  std::vector<ReconstructionId> split_off;  // reconstructions that were split off thereby
  // Stored images that the photo was not compared with, because they are damaged; ascending.
  std::vector<DamagedImage> damaged;
  StepTimes times;
  // Not Ok: the photo was not judged, for a reason that says nothing about it: its file cannot be
  // read, the memory is too short, something stored that it needs is damaged. Nothing was stored,
  // `verdict` and `reason` mean nothing, and the photo may be sent again.
  Status failure;
};

// One step of the work that follows from photos: postponed neighbours tried again, the adjustment
// of a whole reconstruction, a new judgment of a merge that was not believed, a look for a
// reconstruction's place on the earth, a new vocabulary.
// Each is a transaction of its own.
enum class FollowUpKind : uint8_t {
  kPropagation,
  kAdjustment,
  kJudgment,
  kVocabulary,
  kGeoreference
};

struct FollowUp {
  FollowUpKind kind = FollowUpKind::kPropagation;
  ImageId image;  // kPropagation: the one that was tried again
  // kAdjustment: the one that was adjusted. kGeoreference: the one that was looked for. kJudgment:
  // the first of the two that were judged.
  ReconstructionId reconstruction;
  ReconstructionId other;          // kJudgment: the second
  ReconstructionId merged_into;    // kJudgment: valid if the two were merged
  std::vector<ImageId> placed;     // images that got a pose
  std::vector<LostPose> unplaced;  // kAdjustment: in the order in which they lost theirs
  // kAdjustment, kJudgment: new ones, made of a part of it, or of the one of the two.
  std::vector<ReconstructionId> split_off;
  double ms = 0;       // how long it took
  double turn_ms = 0;  // how long of that nobody else could write: of long steps their commit alone
  Status status;  // a failure is the step's own; it is set aside until the database is opened again
};

// A photo that was submitted and waits on the disk for its turn.
struct UploadAnswer {
  uint64_t number = 0;  // from 1, in the order in which they came; never used again
  std::string name, contributor;
  std::string camera;  // its name; empty: it is to be found
  std::string photo;   // SHA-256 of its bytes, in hexadecimal
  uint64_t size_bytes = 0;
  int64_t time_unix_s = 0;    // when it came
  uint32_t contribution = 0;  // that it is a part of; 0: of none
};

struct PhotoProgress;  // engine/schedule/submission_line.h

// A photo on its way. Copies stand for the same photo. Thread-safe.
class Ticket final {
 public:
  Ticket() = default;

  // UploadAnswer::number; 0 for a ticket of no submission.
  uint64_t number() const;
  // Waits for the answer. kCancelled when the photo was cancelled or the engine was closed before
  // its turn came. Any error means that the photo is no part of the city. It still waits on the
  // disk, and is put in line by Engine::Resume, where the engine was closed, where the disk failed
  // (kIoError, kBusy), where the memory was short (kNoMemory), and, unless 2,000 photos wait for
  // that already, where its camera is not named and cannot be told yet (kNotFound).
  Result<AddOutcome> Wait() const;
  bool IsDone() const;
  // Takes the photo out of the line, and off the disk. True when it will not be applied; false when
  // its turn has come already.
  bool Cancel();

 private:
  friend class SubmissionLine;
  explicit Ticket(std::shared_ptr<PhotoProgress> progress) : progress_(std::move(progress)) {}
  std::shared_ptr<PhotoProgress> progress_;
};

// Called once and without any lock held, from the engine's own thread, or from the one that closes
// the engine. It may ask, submit and cancel, and should be quick. It must neither throw, nor close
// the engine, nor call what waits for photos (Ticket::Wait, AddPhotos, Settle): the thread that it
// runs on is the one that applies them.
using AnswerCallback = std::function<void(const Result<AddOutcome>&)>;

struct RemoveRequest {
  std::vector<std::string> photos;  // each by what Questions::Image finds it by; or
  std::string contributor;    // all photos of this contributor, those that wait for their turn, too
  uint32_t contribution = 0;  // all photos of this contribution, and then itself; 0: none
  std::string actor = "anonymous";  // who has them removed; for the journal
  std::string why;                  // for the journal

  Status Check() const;  // the first violated bound, named with its value
};

// One photo that is gone. Nothing stored has its name or its bytes any more.
struct RemovedPhoto {
  ImageId image;
  std::string name;
  ReconstructionId reconstruction;  // valid if it had a pose
  uint64_t observations = 0;        // of points, by its features
  // Photos that stood on it too much: they lost their pose, and Settle tries them again.
  std::vector<ImageId> unplaced;
  bool was_dense = false;  // depth maps or parts of a surface went with it: Densify makes them anew
};

struct RemoveAnswer {
  std::vector<RemovedPhoto> removed;  // in the order of the request
  // Ok: no file of the database has a byte of theirs any more. Otherwise why some may have, which a
  // later Remove or Settle mends: somebody still reads an earlier state, the disk is full.
  Status purged;
  uint64_t uploads = 0;  // photos that waited for their turn, or had arrived in part
  // Copies that were made of this database and that nothing was removed from: of backups the
  // folders that the journal names, of repairs those that lie beside the database.
  std::vector<std::string> copies;
};

// The shape of a vocabulary that a person asks for.
// The defaults are the shape of a vocabulary that the database trains by itself: ten children for
// each node and up to seven levels, from two million descriptors at most, as R8 of docs/paper.md
// says.
struct VocabularyRequest {
  uint32_t branch = 10;  // [2, 64]: children of a node at most
  uint32_t levels = 7;   // [1, 7]: levels of centers below the root
  // 0, or [1000, 16777216]: descriptors that it is trained on, drawn from all photos; all of them
  // where there are fewer. 0: as many as the database takes by itself.
  uint32_t sample = 0;

  Status Check() const;  // the first violated bound, named with its value
};

enum class ForbidKind : uint8_t { kPair, kMerge, kPose };

// Two photos that do not show the same place, two reconstructions that must not be merged, or a
// photo that must not have a pose.
struct ForbidRequest {
  ForbidKind kind = ForbidKind::kPair;
  // Photos by what Questions::Image finds them by; reconstructions by number. Of kPose b is empty.
  std::string a, b;
  std::string actor = "anonymous";  // who says so
  std::string reason;               // for people

  Status Check() const;
};

struct ForbiddenAnswer {
  ForbidKind kind = ForbidKind::kPair;
  ImageId image_a, image_b;                             // kPair, a < b; kPose: the first
  std::string name_a, name_b;                           // of these photos
  ReconstructionId reconstruction_a, reconstruction_b;  // kMerge, a < b
  int64_t time_unix_s = 0;
  std::string actor, reason;
};

}  // namespace veduta
