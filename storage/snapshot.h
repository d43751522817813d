// SPDX-License-Identifier: Apache-2.0
#pragma once
// An unchanging view of the database (storage/database.h). What it returns owns its bytes: it stays
// valid when the snapshot and the database go. Every function is thread-safe.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/contributing.h"
#include "storage/dense.h"
#include "storage/model/camera.h"
#include "storage/model/features.h"
#include "storage/model/forbidden.h"
#include "storage/model/geo.h"
#include "storage/model/hypothesis.h"
#include "storage/model/image.h"
#include "storage/model/journal.h"
#include "storage/model/pair.h"
#include "storage/model/points.h"
#include "storage/model/reconstruction.h"
#include "storage/model/state.h"
#include "storage/model/submap.h"
#include "storage/model/token.h"
#include "storage/model/upload.h"
#include "storage/moderation.h"
#include "storage/records/families.h"
#include "storage/stored_bytes.h"

namespace veduta {

// The functions that call `visit` do so without holding anything that others wait for: visit may
// take its time, and read more from the database.
class Snapshot {
 public:
  virtual ~Snapshot() = default;

  // The snapshot's name: it grows with every commit (and with other writes, by more than one), also
  // over reopening. Two snapshots of one name show the same. 0 where the files were closed already.
  virtual uint64_t sequence() const = 0;

  virtual Result<DatabaseState> GetState() const = 0;
  // The counts of the state record; where it has none (an older program wrote it, and this database
  // is open for reading only), counts all images and cameras.
  virtual Result<DatabaseCounts> GetCounts() const = 0;

  virtual Result<CameraRecord> GetCamera(CameraId id) const = 0;
  virtual Result<std::vector<CameraRecord>> ListCameras() const = 0;  // ascending ids

  virtual Result<ImageRecord> GetImage(ImageId id) const = 0;
  virtual Result<std::optional<ImageId>> FindImageByName(std::string_view name,
                                                         std::string_view contributor) const = 0;
  // Those of all contributors, in the order of these; at most `count_max`.
  virtual Result<std::vector<ImageId>> FindImagesByName(std::string_view name,
                                                        size_t count_max) const = 0;
  // Also the image whose sealed original this is.
  virtual Result<std::optional<ImageId>> FindImageByPhoto(const ContentHash& photo) const = 0;
  // Those whose photo's hash begins with these lower-case hexadecimal digits, in the order of the
  // hashes; at most `count_max`.
  virtual Result<std::vector<ImageId>> FindImagesByPhoto(std::string_view hash_digits,
                                                         size_t count_max) const = 0;
  // Calls visit in ascending ids until it returns false.
  virtual Status ScanImages(const std::function<bool(const ImageRecord&)>& visit) const = 0;

  virtual Result<StoredBytes> GetPhoto(const ContentHash& photo) const = 0;
  virtual Result<Features> GetFeatures(const ContentHash& photo) const = 0;

  virtual Result<PairRecord> GetPair(ImageId a,
                                     ImageId b) const = 0;  // in either order; the record has a < b
  virtual Result<std::vector<PairNeighbor>> ListNeighbors(
      ImageId image) const = 0;  // ascending images

  virtual Result<ReconstructionRecord> GetReconstruction(ReconstructionId id) const = 0;
  virtual Result<std::vector<ReconstructionRecord>> ListReconstructions()
      const = 0;  // ascending ids, merged ones too

  virtual Result<std::optional<PoseRecord>> FindPose(ImageId image) const = 0;
  virtual Status ScanPoses(const std::function<bool(const PoseRecord&)>& visit) const = 0;
  // Ascending features; may be empty.
  virtual Result<std::vector<Observation>> GetObservations(ImageId image) const = 0;

  // Empty block (next_ordinal 1) where the image is home to none.
  virtual Result<PointBlock> GetPointBlock(ReconstructionId reconstruction, uint32_t generation,
                                           ImageId home) const = 0;
  virtual Status ScanPointBlocks(ReconstructionId reconstruction, uint32_t generation,
                                 const std::function<bool(const PointBlock&)>& visit) const = 0;

  // The serialized vocabulary tree of a generation.
  virtual Result<StoredBytes> GetVocabulary(uint32_t generation) const = 0;
  // Distinct words of one image, ascending.
  virtual Result<std::vector<WordId>> GetWords(uint32_t generation, ImageId image) const = 0;
  // images[i] are those that contain words[i], ascending; words ascend.
  virtual Result<std::vector<std::vector<ImageId>>> GetPostings(
      uint32_t generation, std::span<const WordId> words) const = 0;
  virtual Status ScanPostings(
      uint32_t generation,
      const std::function<bool(WordId, std::span<const ImageId>)>& visit) const = 0;

  // Ascending sequence numbers from `first`.
  virtual Status ScanJournal(uint64_t first,
                             const std::function<bool(const JournalRecord&)>& visit) const = 0;

  // Photos that wait for their turn; ascending numbers.
  virtual Result<std::vector<UploadRecord>> ListUploads() const = 0;
  // kNotFound where none of that number waits.
  virtual Result<UploadRecord> GetUpload(uint64_t number) const = 0;
  virtual Result<StoredBytes> GetUploadBytes(uint64_t number) const = 0;

  // What people have forbidden; ascending kinds, then ids.
  virtual Result<std::vector<ForbiddenRecord>> ListForbidden() const = 0;
  // Whether the two, in either order, are forbidden: these photos, or exactly these records of
  // reconstructions, wherever they have been merged to since (engine/query/forbidden.h follows).
  virtual Result<bool> IsForbidden(ForbiddenKind kind, uint32_t a, uint32_t b) const = 0;
  virtual Result<std::vector<GroundPoint>> ListGroundPoints() const = 0;  // ascending names
  virtual Result<std::vector<TokenRecord>> ListTokens() const = 0;        // ascending numbers
  virtual Result<std::optional<TokenRecord>> FindToken(uint32_t number) const = 0;
  // Merges that are not believed yet; ascending reconstructions. O(its length).
  virtual Result<std::vector<HypothesisRecord>> ListHypotheses() const = 0;
  // The parts of large reconstructions; ascending ids. O(images in them).
  virtual Result<std::vector<SubmapRecord>> ListSubmaps() const = 0;
  // What ties the submap to its neighbours; nothing where it was not adjusted yet.
  virtual Result<std::optional<SubmapBorder>> FindSubmapBorder(SubmapId id) const = 0;

  // What the dense pass made; lives as long as the snapshot.
  virtual const DenseReader& dense() const = 0;
  // Uploads in parts, and contributions; lives as long as the snapshot.
  virtual const ContributingReader& contributing() const = 0;
  // What is hidden, reported and used up; lives as long as the snapshot.
  virtual const ModerationReader& moderation() const = 0;

  // Every key of a family with its value as it lies, not decoded: for `verify`. Ascending keys,
  // until visit returns false. A value in a blob file that cannot be read comes as the failure of
  // reading it, and the scan goes on; a table file that cannot be read ends it with kCorruption.
  using VisitStored = std::function<bool(std::string_view key, const Result<StoredBytes>& value)>;
  virtual Status ScanStored(Family family, const VisitStored& visit) const = 0;
  // Reads all table files and compares their checksums: kCorruption names the file. Blob files are
  // not read: their values are compared with their checksums whenever they are read.
  virtual Status VerifyChecksums() const = 0;

  // Keys of blobs that are stored: for `verify`.
  virtual Status ScanPhotoKeys(const std::function<bool(const ContentHash&)>& visit) const = 0;
  virtual Status ScanFeatureKeys(const std::function<bool(const ContentHash&)>& visit) const = 0;
  // The photo was written ahead of a commit that has not come yet.
  virtual Result<bool> IsWrittenAhead(const ContentHash& photo) const = 0;
  // What such a photo is called; nothing where its mark does not tell.
  virtual Result<std::optional<PhotoName>> FindNameAhead(const ContentHash& photo) const = 0;

  // What the image's photo was made of by filling private areas; kNotFound where it was not.
  virtual Result<StoredBytes> GetOriginal(ImageId image) const = 0;
};

}  // namespace veduta
