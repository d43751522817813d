// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes to the database's files that become visible and durable together, or not at all.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "storage/base/content_hash.h"
#include "storage/base/status.h"
#include "storage/dense.h"
#include "storage/model/camera.h"
#include "storage/model/contribution.h"
#include "storage/model/features.h"
#include "storage/model/forbidden.h"
#include "storage/model/geo.h"
#include "storage/model/hypothesis.h"
#include "storage/model/image.h"
#include "storage/model/journal.h"
#include "storage/model/moderation.h"
#include "storage/model/pair.h"
#include "storage/model/points.h"
#include "storage/model/reconstruction.h"
#include "storage/model/state.h"
#include "storage/model/submap.h"
#include "storage/model/token.h"

namespace veduta {

class Snapshot;  // storage/snapshot.h

// Collects writes in memory; nothing is visible before Commit. Not thread-safe.
//
// Reads on which the writes depend go to base(). It is taken after the version of the state that
// Commit compares: whatever another transaction has changed is either in base(), or a conflict.
// Write-aheads that the commit will name are to be written after BeginTransaction, too: Reopen
// deletes those of generations, and refuses the commit.
//
// A record that breaks an invariant of its struct (its Check in storage/records/: a number that is
// not finite, a list out of order, an id of 0, ...) makes Commit fail with kInvalidArgument, and
// nothing is applied.
class Transaction {
 public:
  virtual ~Transaction() = default;

  // The database as it was when the transaction began. Aborts after Commit; a copy that was taken
  // before stays valid.
  virtual std::shared_ptr<const Snapshot> base() const = 0;

  // Clears vocabulary_generation's write-ahead mark. `state.counts` is ignored: Commit writes the
  // counts of base() with what PutImage and PutCamera have changed.
  virtual void PutState(const DatabaseState& state) = 0;
  virtual void PutCamera(const CameraRecord& camera) = 0;
  // Also indexes the image by name and contributor (unless it is rejected with kNameTaken: the name
  // stays with its owner). Unless it is rejected, indexes it by photo hash, too, and clears the
  // photo's mark: what was written ahead stays. A rejected image changes nothing of that: the same
  // bytes may be on their way in another submission.
  virtual void PutImage(const ImageRecord& image) = 0;
  // What is stored for the photo of a kept image are these features, also where another submission
  // of the same bytes, with another camera, has written its own ahead. Costs nothing where none
  // has.
  virtual void KeepFeatures(const ContentHash& photo, std::shared_ptr<const Features> features) = 0;
  virtual void PutPair(const PairRecord& pair) = 0;
  virtual void PutReconstruction(
      const ReconstructionRecord& reconstruction) = 0;  // clears points_generation's mark
  virtual void PutPose(const PoseRecord& pose) = 0;
  virtual void DeletePose(ImageId image) = 0;  // with its observations
  virtual void PutObservations(ImageId image, std::span<const Observation> observations) = 0;
  // Deletes the block when it holds no points and never did (next_ordinal 1).
  virtual void PutPointBlock(ReconstructionId reconstruction, uint32_t generation,
                             const PointBlock& block) = 0;
  virtual void DeletePointBlocks(ReconstructionId reconstruction, uint32_t generation) = 0;
  virtual void PutWords(uint32_t generation, ImageId image, std::span<const WordId> words) = 0;
  virtual void AddPostings(uint32_t generation, std::span<const WordId> words, ImageId image) = 0;
  virtual void DeleteVocabulary(uint32_t generation) = 0;  // tree, words and postings
  // Takes back PutWords and AddPostings of the image with these words, for ever: its postings that
  // are added in this generation, before or after, count for nothing.
  virtual void RemoveWords(uint32_t generation, std::span<const WordId> words, ImageId image) = 0;
  // Deletes all that is stored of this image alone: its record, its name, its photo with hash and
  // features, its pairs, its words and its place in the posting lists. What the map holds of it
  // (pose, observations, points) and what the dense pass made of it is the caller's. Reads base().
  virtual void RemoveImage(ImageId image) = 0;
  // Deletes a photo with its hash and its features: the image that had it has another one now.
  virtual void DeletePhoto(const ContentHash& photo) = 0;
  virtual void DeletePair(ImageId a, ImageId b) = 0;  // in either order; also where there is none
  virtual void PutForbidden(const ForbiddenRecord& forbidden) = 0;
  virtual void DeleteForbidden(ForbiddenKind kind, uint32_t a, uint32_t b) = 0;  // either order
  // Replaces the one of the same two reconstructions.
  virtual void PutHypothesis(const HypothesisRecord& hypothesis) = 0;
  // In either order; also where there is none.
  virtual void DeleteHypothesis(ReconstructionId a, ReconstructionId b) = 0;
  virtual void PutSubmap(const SubmapRecord& submap) = 0;  // replaces the one of its id
  virtual void DeleteSubmap(SubmapId id) = 0;  // with its border; also where there is none
  virtual void PutSubmapBorder(const SubmapBorder& border) = 0;  // replaces the one of its id
  virtual void PutGroundPoint(const GroundPoint& point) = 0;     // replaces the one of its name
  virtual void DeleteGroundPoint(const std::string& name) = 0;   // also where there is none
  virtual void PutToken(const TokenRecord& token) = 0;           // replaces the one of its number
  virtual void PutHidden(const HiddenRecord& hidden) = 0;        // replaces the one of its number
  virtual void DeleteHidden(HiddenKind kind, uint32_t number) = 0;  // also where there is none
  virtual void PutReport(const ReportRecord& report) = 0;  // replaces the one of its number
  // Replaces the one of its number. One call at a time with Database::AddUpload, whose photos it
  // counts.
  virtual void PutContribution(const ContributionRecord& contribution) = 0;
  virtual void PutContributedPhoto(const ContributedPhoto& photo) = 0;
  // With the entries of its photos; the photos themselves stay. Reads base().
  virtual void RemoveContribution(uint32_t number) = 0;
  virtual void AddJournal(const JournalRecord& record) = 0;

  // Writes of the dense pass, part of the same commit.
  virtual DenseWriter& dense() = 0;

  virtual size_t size_bytes() const = 0;
  // All or nothing; durable on return when the database syncs its WAL, together with everything
  // written ahead before. kIoError leaves nothing visible; all later writes through this database
  // fail, too, until it is opened again, and only then is it known whether the log had kept this
  // commit: whole, or not at all. kBusy when another transaction has committed a state record, or a
  // change of the counts, since this one began: nothing was applied. The transaction is spent
  // either way: a second Commit is kInvalidArgument, a Put after it aborts.
  virtual Status Commit() = 0;

  // Keeps the bytes that an image's photo was made of, where private areas of it were filled
  // before it was stored: no photo of any image, found by their hash all the same. RemoveImage
  // deletes them.
  virtual void SealOriginal(ImageId image, std::span<const uint8_t> bytes) = 0;
  // Where the stored image has such bytes.
  virtual void DeleteOriginal(ImageId image) = 0;
};

}  // namespace veduta
