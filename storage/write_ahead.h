// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is written before its commit: photos with their features, generations of point blocks and of
// the vocabulary. Each lies under a mark in `queue` until a commit names it. Whoever wrote it gives
// it up when the commit has not come (the Drop functions, called by WrittenAhead); what is still
// marked when the database is opened, and not named by any record, is deleted then.

#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/database_files.h"
#include "storage/model/features.h"
#include "storage/model/image.h"
#include "storage/model/points.h"

namespace veduta {

// How many submissions count on a photo that is not committed yet: the same bytes may come under
// two names, and one of them being dropped must not take the photo from the other. Claims outlive
// Database::Reopen, which keeps the photos that are claimed. Thread-safe.
class PhotoClaims final {
 public:
  // One claim more; true when the photo was claimed already.
  bool Add(const ContentHash& photo);
  // One claim less; true when none is left.
  bool Release(const ContentHash& photo);
  // After a commit: the record keeps the photo from now on.
  void Forget(const ContentHash& photo);
  bool Has(const ContentHash& photo) const;
  std::vector<ContentHash> List() const;

  // The features that are stored now are not those of every submission that claims the photo: the
  // same bytes came with two cameras.
  void NoteOtherFeatures(const ContentHash& photo);
  bool HasOtherFeatures(const ContentHash& photo) const;

  // After the database has been opened again: the claimed photos that are not among `kept` are not
  // on the disk. They count as lost until somebody writes them ahead anew.
  void LoseAllBut(const std::set<ContentHash>& kept);
  void NoteWritten(const ContentHash& photo);
  // kIoError when the photo is lost: no record may name it then.
  Status CheckKept(const ContentHash& photo) const;

 private:
  struct Claim {
    uint32_t count = 0;
    bool is_lost = false;
    bool has_other_features = false;
  };
  mutable std::mutex mutex_;
  std::map<ContentHash, Claim> claims_;
};

// The functions below are those of Database, on its files. Thread-safe.
Status WritePhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo,
                       std::span<const uint8_t> bytes, const Features& features,
                       const PhotoName& name);
Status DropPhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo);
Status DropPointBlocksAhead(DatabaseFiles& files, ReconstructionId reconstruction,
                            uint32_t generation);
Status DropVocabularyAhead(DatabaseFiles& files, uint32_t generation);
Status WritePointBlocksAhead(DatabaseFiles& files, ReconstructionId reconstruction,
                             uint32_t generation, std::span<const PointBlock> blocks);
Status WriteVocabularyAhead(DatabaseFiles& files, uint32_t generation,
                            std::span<const uint8_t> tree);
Status WriteWordsAhead(DatabaseFiles& files, uint32_t generation, ImageId image,
                       std::span<const WordId> words);
// Adds the images to those that the word's list has.
Status WritePostingsAhead(DatabaseFiles& files, uint32_t generation, WordId word,
                          std::span<const ImageId> images);

// Deletes what marks name and records do not, and the marks; photos that are claimed stay, with
// their marks, where their features are there, too. Proportional to the number of marks. Not
// durable by itself: a sweep that is lost is repeated.
Status SweepWriteAheads(DatabaseFiles& files, PhotoClaims& claims);

}  // namespace veduta
