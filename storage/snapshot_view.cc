// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <utility>

#include "storage/blob_keys.h"
#include "storage/contributing_view.h"
#include "storage/dense_view.h"
#include "storage/moderation_view.h"
#include "storage/record_counts.h"
#include "storage/record_finder.h"
#include "storage/records/border_record.h"
#include "storage/records/camera_record.h"
#include "storage/records/earth_record.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/hypothesis_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/sealed_record.h"
#include "storage/records/state_record.h"
#include "storage/records/submap_record.h"
#include "storage/records/token_record.h"
#include "storage/records/upload_record.h"
#include "storage/records/vocabulary_record.h"
#include "storage/records/write_ahead_mark.h"
#include "storage/rocksdb_status.h"
#include "storage/snapshot.h"
#include "storage/snapshot_handle.h"
#include "storage/snapshot_view.h"
#include "storage/uploads.h"
#include "storage/value_reader.h"

namespace veduta {
namespace {

std::string Number(uint64_t value) {
  return std::to_string(value);
}

// The u32 that a key ends with, after its prefix.
Status IdAfter(size_t prefix_bytes, std::string_view key, uint32_t* id) {
  std::string_view rest = key.substr(prefix_bytes);
  if (!TakeBigEndian32(&rest, id) || !rest.empty())
    return Status::Corruption("a key of wrong length");
  if (*id == 0) return Status::Corruption("a key with id 0");
  return Status::Ok();
}

Status DecodeImageNumber(std::string_view value, ImageId* image) {
  VEDUTA_RETURN_IF_ERROR(DecodeU32(value, &image->value));
  return image->valid() ? Status::Ok() : Status::Corruption("image id 0");
}

class SnapshotView final : public Snapshot {
 public:
  explicit SnapshotView(std::shared_ptr<const DatabaseFiles> files)
      : files_(std::move(files)),
        snapshot_(files_),
        reader_(*files_, snapshot_.get()),
        dense_(MakeDenseReader(reader_)),
        contributing_(MakeContributingReader(reader_)),
        moderation_(MakeModerationReader(reader_)) {}

  uint64_t sequence() const override { return snapshot_.sequence(); }

  Result<DatabaseState> GetState() const override {
    DatabaseState state;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kMeta, kStateKey, [] { return "state record"; }, &state));
    return state;
  }

  Result<DatabaseCounts> GetCounts() const override {
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, GetState());
    if (state.counts) return *state.counts;
    return CountRecords(*this);
  }

  Result<CameraRecord> GetCamera(CameraId id) const override {
    CameraRecord camera;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kCameras, CameraKey(id), [&] { return "camera " + Number(id.value); }, &camera,
        id));
    return camera;
  }

  Result<std::vector<CameraRecord>> ListCameras() const override {
    return List<CameraId, CameraRecord>(Family::kCameras);
  }

  Result<ImageRecord> GetImage(ImageId id) const override {
    ImageRecord image;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kImages, ImageKey(id), [&] { return "image " + Number(id.value); }, &image, id));
    return image;
  }

  Result<std::optional<ImageId>> FindImageByName(std::string_view name,
                                                 std::string_view contributor) const override {
    return FindImage(Family::kNames, NameKey(name, contributor));
  }

  Result<std::vector<ImageId>> FindImagesByName(std::string_view name,
                                                size_t count_max) const override {
    return FindImages(
        Family::kNames, NamePrefix(name), [](std::string_view) { return true; }, count_max);
  }

  Result<std::optional<ImageId>> FindImageByPhoto(const ContentHash& photo) const override {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> image,
                            FindImage(Family::kHashes, HashKey(photo)));
    return image ? image : FindImage(Family::kMeta, SealedKey(photo));
  }

  Result<std::vector<ImageId>> FindImagesByPhoto(std::string_view hash_digits,
                                                 size_t count_max) const override {
    const auto begins_so = [&](std::string_view key) {
      ContentHash photo;
      return ParseHashKey(key, &photo) && photo.Hex().starts_with(hash_digits);
    };
    return FindImages(Family::kHashes, HashKeyPrefix(hash_digits), begins_so, count_max);
  }

  Status ScanImages(const std::function<bool(const ImageRecord&)>& visit) const override {
    return ScanRecords<ImageId, ImageRecord>(Family::kImages, "", visit);
  }

  Result<StoredBytes> GetPhoto(const ContentHash& photo) const override {
    return GetBytes(Family::kPhotos, HashKey(photo), [&] { return "photo " + photo.Hex(); });
  }

  Result<StoredBytes> GetOriginal(ImageId image) const override {
    return GetBytes(Family::kUploads, OriginalKey(image),
                    [&] { return "original of image " + Number(image.value); });
  }

  Result<Features> GetFeatures(const ContentHash& photo) const override {
    Features features;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kFeatures, HashKey(photo), [&] { return "features of photo " + photo.Hex(); },
        &features));
    return features;
  }

  Result<PairRecord> GetPair(ImageId a, ImageId b) const override {
    const ImageId smaller = std::min(a, b), larger = std::max(a, b);
    PairRecord pair;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kPairs, PairKey(smaller, larger),
        [&] { return "pair of images " + Number(smaller.value) + " and " + Number(larger.value); },
        &pair, smaller, larger));
    return pair;
  }

  Result<std::vector<PairNeighbor>> ListNeighbors(ImageId image) const override {
    std::vector<PairNeighbor> neighbors;
    const auto collect = [&](const PairNeighbor& neighbor) {
      neighbors.push_back(neighbor);
      return true;
    };
    VEDUTA_RETURN_IF_ERROR(
        (ScanRecords<ImageId, PairNeighbor>(Family::kPairs, NeighborPrefix(image), collect)));
    return neighbors;
  }

  Result<ReconstructionRecord> GetReconstruction(ReconstructionId id) const override {
    ReconstructionRecord record;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kReconstructions, ReconstructionKey(id),
        [&] { return "reconstruction " + Number(id.value); }, &record, id));
    return record;
  }

  Result<std::vector<ReconstructionRecord>> ListReconstructions() const override {
    return List<ReconstructionId, ReconstructionRecord>(Family::kReconstructions);
  }

  Result<std::optional<PoseRecord>> FindPose(ImageId image) const override {
    PoseRecord pose;
    VEDUTA_ASSIGN_OR_RETURN(const bool found,
                            FindRecord(Family::kPoses, ImageKey(image), &pose, image));
    return found ? std::optional(pose) : std::nullopt;
  }

  Status ScanPoses(const std::function<bool(const PoseRecord&)>& visit) const override {
    return ScanRecords<ImageId, PoseRecord>(Family::kPoses, "", visit);
  }

  Result<std::vector<Observation>> GetObservations(ImageId image) const override {
    std::vector<Observation> observations;
    VEDUTA_RETURN_IF_ERROR(
        FindRecord(Family::kObservations, ImageKey(image), &observations).status());
    return observations;
  }

  Result<PointBlock> GetPointBlock(ReconstructionId reconstruction, uint32_t generation,
                                   ImageId home) const override {
    PointBlock block;
    const std::string key = PointBlockKey(reconstruction, generation, home);
    VEDUTA_ASSIGN_OR_RETURN(const bool found, FindRecord(Family::kPoints, key, &block, home));
    if (!found) block.home = home;
    return block;
  }

  Status ScanPointBlocks(ReconstructionId reconstruction, uint32_t generation,
                         const std::function<bool(const PointBlock&)>& visit) const override {
    return ScanRecords<ImageId, PointBlock>(Family::kPoints,
                                            PointBlockPrefix(reconstruction, generation), visit);
  }

  Result<StoredBytes> GetVocabulary(uint32_t generation) const override {
    return GetBytes(Family::kVocabulary, VocabularyKey(generation),
                    [&] { return "vocabulary generation " + Number(generation); });
  }

  Result<std::vector<WordId>> GetWords(uint32_t generation, ImageId image) const override {
    const std::string key = WordsKey(generation, image);
    std::vector<WordId> words;
    VEDUTA_ASSIGN_OR_RETURN(const bool found,
                            reader_.Read(Family::kWords, key, [&](std::string_view value) {
                              return DecodeWords(value, &words);
                            }));
    if (found) return words;
    return Status::NotFound("there are no words of image " + Number(image.value) +
                            " in vocabulary generation " + Number(generation));
  }

  Result<std::vector<std::vector<ImageId>>> GetPostings(
      uint32_t generation, std::span<const WordId> words) const override {
    VEDUTA_RETURN_IF_ERROR(CheckWords(words));
    std::vector<std::string> keys;
    keys.reserve(words.size());
    for (const WordId word : words) keys.push_back(PostingsKey(generation, word));
    std::vector<std::vector<ImageId>> images(words.size());
    VEDUTA_RETURN_IF_ERROR(reader_.ReadMany(
        Family::kPostings, keys,
        [&](size_t i, std::string_view value) { return DecodeImages(value, &images[i]); }));
    return images;
  }

  Status ScanPostings(
      uint32_t generation,
      const std::function<bool(WordId, std::span<const ImageId>)>& visit) const override {
    const std::string prefix = VocabularyKey(generation);
    std::vector<ImageId> images;
    return reader_.Scan(Family::kPostings, prefix, "",
                        [&](std::string_view key, std::string_view value, bool* more) {
                          std::string_view rest = key.substr(prefix.size());
                          WordId word = 0;
                          if (!TakeBigEndian32(&rest, &word) || !rest.empty())
                            return Status::Corruption("a key of wrong length");
                          VEDUTA_RETURN_IF_ERROR(DecodeImages(value, &images));
                          // All images that had the word were removed.
                          if (!images.empty()) *more = visit(word, images);
                          return Status::Ok();
                        });
  }

  Status ScanJournal(uint64_t first,
                     const std::function<bool(const JournalRecord&)>& visit) const override {
    const std::string from = JournalKey(first);
    JournalRecord record;
    return reader_.Scan(Family::kJournal, "", from,
                        [&](std::string_view key, std::string_view value, bool* more) {
                          uint64_t sequence = 0;
                          if (!TakeBigEndian64(&key, &sequence) || !key.empty())
                            return Status::Corruption("a key of wrong length");
                          VEDUTA_RETURN_IF_ERROR(Decode(value, sequence, &record));
                          *more = visit(record);
                          return Status::Ok();
                        });
  }

  Result<std::vector<UploadRecord>> ListUploads() const override {
    return veduta::ListUploads(reader_);
  }

  Result<UploadRecord> GetUpload(uint64_t number) const override {
    UploadRecord upload;
    VEDUTA_RETURN_IF_ERROR(GetRecord(
        Family::kUploads, UploadKey(number), [&] { return "upload " + Number(number); }, &upload,
        number));
    return upload;
  }

  Result<StoredBytes> GetUploadBytes(uint64_t number) const override {
    return GetBytes(Family::kUploads, UploadBytesKey(number),
                    [&] { return "photo of upload " + Number(number); });
  }

  Result<std::vector<ForbiddenRecord>> ListForbidden() const override {
    return ListFacts<ForbiddenRecord>(reader_, kForbiddenPrefix, ParseForbiddenKey);
  }

  Result<bool> IsForbidden(ForbiddenKind kind, uint32_t a, uint32_t b) const override {
    return reader_.Has(Family::kMeta, ForbiddenKey(kind, std::min(a, b), std::max(a, b)));
  }

  Result<std::vector<GroundPoint>> ListGroundPoints() const override {
    return ListFacts<GroundPoint>(reader_, kGroundPointPrefix, ParseGroundPointKey);
  }

  Result<std::vector<TokenRecord>> ListTokens() const override {
    return ListFacts<TokenRecord>(reader_, kTokenPrefix, ParseTokenKey);
  }

  Result<std::optional<TokenRecord>> FindToken(uint32_t number) const override {
    TokenRecord token;
    token.number = number;
    VEDUTA_ASSIGN_OR_RETURN(const bool found, FindRecord(Family::kMeta, TokenKey(number), &token));
    return found ? std::optional(std::move(token)) : std::nullopt;
  }

  Result<std::vector<HypothesisRecord>> ListHypotheses() const override {
    return ListFacts<HypothesisRecord>(reader_, kHypothesisPrefix, ParseHypothesisKey);
  }

  Result<std::vector<SubmapRecord>> ListSubmaps() const override {
    return ListFacts<SubmapRecord>(reader_, kSubmapPrefix, ParseSubmapKey);
  }

  Result<std::optional<SubmapBorder>> FindSubmapBorder(SubmapId id) const override {
    SubmapBorder border;
    border.id = id;
    VEDUTA_ASSIGN_OR_RETURN(const bool found, FindRecord(Family::kMeta, BorderKey(id), &border));
    return found ? std::optional(std::move(border)) : std::nullopt;
  }

  const DenseReader& dense() const override { return *dense_; }
  const ContributingReader& contributing() const override { return *contributing_; }
  const ModerationReader& moderation() const override { return *moderation_; }

  Status ScanStored(Family family, const VisitStored& visit) const override {
    if (TraitsOf(family).store == ValueStore::kTable) {
      return reader_.Scan(family, "", "",
                          [&](std::string_view key, std::string_view value, bool* more) {
                            *more = visit(key, StoredBytes(std::string(value)));
                            return Status::Ok();
                          });
    }
    // ScanBlobKeys would miss what a later write than this snapshot has deleted with a range of
    // keys. An iterator does not, but ends at a value that it cannot read.
    std::optional<std::string> last;
    if (TraitsOf(family).deletes_ranges) {
      const Status scanned = reader_.Scan(
          family, "", "", [&](std::string_view key, std::string_view value, bool* more) {
            last = key;
            *more = visit(key, StoredBytes(std::string(value)));
            return Status::Ok();
          });
      if (scanned.ok()) return scanned;
    }
    return ScanBlobKeys(*files_, family, sequence(), [&](std::string_view key) -> Result<bool> {
      if (last && key <= *last) return true;
      std::string value;
      const Result<bool> found = reader_.Copy(family, key, &value);
      if (!found.ok()) return visit(key, found.status());
      if (!*found) return true;  // deleted with a range of keys
      return visit(key, StoredBytes(std::move(value)));
    });
  }

  Status VerifyChecksums() const override {
    const FilesLease lease(*files_);
    VEDUTA_RETURN_IF_ERROR(lease.status());
    rocksdb::ReadOptions options;
    options.fill_cache = false;
    return FromRocksdb(files_->db().VerifyChecksum(options), "verify the checksums of the files");
  }

  Status ScanPhotoKeys(const std::function<bool(const ContentHash&)>& visit) const override {
    return ScanHashes(Family::kPhotos, visit);
  }

  Status ScanFeatureKeys(const std::function<bool(const ContentHash&)>& visit) const override {
    return ScanHashes(Family::kFeatures, visit);
  }

  Result<bool> IsWrittenAhead(const ContentHash& photo) const override {
    return reader_.Has(Family::kQueue, PhotoMarkKey(photo));
  }

  Result<std::optional<PhotoName>> FindNameAhead(const ContentHash& photo) const override {
    std::optional<PhotoName> found;
    const auto parse = [&](std::string_view value) {
      PhotoName name;
      if (ParseNameKey(value, &name)) found = std::move(name);
      return Status::Ok();
    };
    VEDUTA_RETURN_IF_ERROR(reader_.Read(Family::kQueue, PhotoMarkKey(photo), parse).status());
    return found;
  }

 private:
  // False where there is none. `ids` are those the key holds.
  template <typename Record, typename... Ids>
  Result<bool> FindRecord(Family family, std::string_view key, Record* record, Ids... ids) const {
    return reader_.Read(family, key,
                        [&](std::string_view value) { return Decode(value, ids..., record); });
  }

  template <typename What, typename Record, typename... Ids>
  Status GetRecord(Family family, std::string_view key, What&& what, Record* record,
                   Ids... ids) const {
    VEDUTA_ASSIGN_OR_RETURN(const bool found, FindRecord(family, key, record, ids...));
    return found ? Status::Ok() : Status::NotFound("there is no " + std::string(what()));
  }

  template <typename What>
  Result<StoredBytes> GetBytes(Family family, std::string_view key, What&& what) const {
    std::string value;
    VEDUTA_ASSIGN_OR_RETURN(const bool found, reader_.Copy(family, key, &value));
    if (!found) return Status::NotFound("there is no " + what());
    return StoredBytes(std::move(value));
  }

  Result<std::optional<ImageId>> FindImage(Family family, std::string_view key) const {
    ImageId image;
    VEDUTA_ASSIGN_OR_RETURN(const bool found,
                            reader_.Read(family, key, [&](std::string_view value) {
                              return DecodeImageNumber(value, &image);
                            }));
    return found ? std::optional(image) : std::nullopt;
  }

  template <typename Wanted>
  Result<std::vector<ImageId>> FindImages(Family family, const std::string& prefix,
                                          const Wanted& is_wanted, size_t count_max) const {
    std::vector<ImageId> images;
    if (count_max == 0) return images;
    const auto visit = [&](std::string_view key, std::string_view value, bool* more) {
      if (!is_wanted(key)) return Status::Ok();
      VEDUTA_RETURN_IF_ERROR(DecodeImageNumber(value, &images.emplace_back()));
      *more = images.size() < count_max;
      return Status::Ok();
    };
    VEDUTA_RETURN_IF_ERROR(reader_.Scan(family, prefix, "", visit));
    return images;
  }

  // Records of one run of keys, each the prefix and an id.
  template <typename Id, typename Record>
  Status ScanRecords(Family family, const std::string& prefix,
                     const std::function<bool(const Record&)>& visit) const {
    Record record;
    return reader_.Scan(family, prefix, "",
                        [&](std::string_view key, std::string_view value, bool* more) {
                          Id id;
                          VEDUTA_RETURN_IF_ERROR(IdAfter(prefix.size(), key, &id.value));
                          VEDUTA_RETURN_IF_ERROR(Decode(value, id, &record));
                          *more = visit(record);
                          return Status::Ok();
                        });
  }

  template <typename Id, typename Record>
  Result<std::vector<Record>> List(Family family) const {
    std::vector<Record> records;
    const auto collect = [&](const Record& record) {
      records.push_back(record);
      return true;
    };
    VEDUTA_RETURN_IF_ERROR((ScanRecords<Id, Record>(family, "", collect)));
    return records;
  }

  Status ScanHashes(Family family, const std::function<bool(const ContentHash&)>& visit) const {
    return ScanBlobKeys(*files_, family, sequence(), [&](std::string_view key) -> Result<bool> {
      ContentHash hash;
      if (!ParseHashKey(key, &hash))
        return InValue(family, key, Status::Corruption("a key of wrong length"));
      return visit(hash);
    });
  }

  const std::shared_ptr<const DatabaseFiles> files_;
  const SnapshotHandle snapshot_;
  const ValueReader reader_;
  const std::unique_ptr<const DenseReader> dense_;
  const std::unique_ptr<const ContributingReader> contributing_;
  const std::unique_ptr<const ModerationReader> moderation_;
};

}  // namespace

std::shared_ptr<const Snapshot> MakeSnapshot(std::shared_ptr<const DatabaseFiles> files) {
  return std::make_shared<SnapshotView>(std::move(files));
}

}  // namespace veduta
