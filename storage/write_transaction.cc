// SPDX-License-Identifier: Apache-2.0
// A write batch and one version number do what RocksDB's optimistic transactions would do here, for
// less: this process alone has the database open, only the state record is fought over, reads go to
// snapshots, and a batch can delete ranges, which those transactions cannot.
#include "storage/write_transaction.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/dense_view.h"
#include "storage/record_counts.h"
#include "storage/records/border_record.h"
#include "storage/records/camera_record.h"
#include "storage/records/contribution_record.h"
#include "storage/records/earth_record.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/hidden_record.h"
#include "storage/records/hypothesis_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/report_record.h"
#include "storage/records/sealed_record.h"
#include "storage/records/state_record.h"
#include "storage/records/submap_record.h"
#include "storage/records/token_record.h"
#include "storage/records/vocabulary_record.h"
#include "storage/records/write_ahead_mark.h"
#include "storage/snapshot_view.h"
#include "storage/write_buffer.h"

namespace veduta {
namespace {

class WriteTransaction final : public Transaction {
 public:
  WriteTransaction(std::shared_ptr<DatabaseFiles> files, std::shared_ptr<PhotoClaims> claims)
      : files_(std::move(files)),
        claims_(std::move(claims)),
        state_version_(files_->state_version()),
        base_(MakeSnapshot(files_)) {
    buffer_.emplace(*files_);
    dense_ = MakeDenseWriter([this]() -> WriteBuffer& { return buffer(); });
  }

  std::shared_ptr<const Snapshot> base() const override {
    VEDUTA_CHECK(base_ != nullptr, "a transaction was read from after its Commit");
    return base_;
  }

  void PutState(const DatabaseState& state) override {
    state_ = state;
    if (state.vocabulary_generation != 0)
      buffer().Delete(Family::kQueue, VocabularyMarkKey(state.vocabulary_generation));
  }

  void PutCamera(const CameraRecord& camera) override {
    buffer().Note(count_changes_.NotePut(*base_, camera));
    buffer().Put(Family::kCameras, CameraKey(camera.id), Encode(camera));
  }

  void PutImage(const ImageRecord& image) override {
    buffer().Note(count_changes_.NotePut(*base_, image));
    buffer().Put(Family::kImages, ImageKey(image.id), Encode(image));
    const std::string id = EncodeU32(image.id.value);
    // The name stays with the image that had it first.
    if (image.reason != Reason::kNameTaken)
      buffer().Put(Family::kNames, NameKey(image.name, image.contributor), std::string_view(id));
    if (image.verdict != Verdict::kRejected) {
      buffer().Put(Family::kHashes, HashKey(image.photo), std::string_view(id));
      kept_photos_.push_back(image.photo);
      // A rejected image keeps nothing, so the mark of another submission of its bytes stays.
      buffer().Delete(Family::kQueue, PhotoMarkKey(image.photo));
    }
  }

  void KeepFeatures(const ContentHash& photo, std::shared_ptr<const Features> features) override {
    kept_features_.emplace_back(photo, std::move(features));
  }

  void PutPair(const PairRecord& pair) override {
    buffer().Put(Family::kPairs, PairKey(pair.a, pair.b), Encode(pair));
    const uint32_t count = static_cast<uint32_t>(pair.matches.size());
    buffer().Put(Family::kPairs, NeighborKey(pair.a, pair.b),
                 Encode(PairNeighbor{pair.b, count, pair.geometry}));
    buffer().Put(Family::kPairs, NeighborKey(pair.b, pair.a),
                 Encode(PairNeighbor{pair.a, count, pair.geometry}));
  }

  void DeletePair(ImageId a, ImageId b) override {
    buffer().Delete(Family::kPairs, PairKey(std::min(a, b), std::max(a, b)));
    buffer().Delete(Family::kPairs, NeighborKey(a, b));
    buffer().Delete(Family::kPairs, NeighborKey(b, a));
  }

  void DeletePhoto(const ContentHash& photo) override {
    for (const Family family : {Family::kHashes, Family::kPhotos, Family::kFeatures})
      buffer().Delete(family, HashKey(photo));
  }

  void SealOriginal(ImageId image, std::span<const uint8_t> bytes) override {
    buffer().Put(Family::kMeta, SealedKey(HashContent(bytes)),
                 std::string_view(EncodeU32(image.value)));
    buffer().Put(Family::kUploads, OriginalKey(image),
                 std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }

  void DeleteOriginal(ImageId image) override {
    const Result<StoredBytes> original = base_->GetOriginal(image);
    if (original.ok()) {
      buffer().Delete(Family::kMeta, SealedKey(HashContent(original->bytes())));
      buffer().Delete(Family::kUploads, OriginalKey(image));
    } else if (original.status().code() != StatusCode::kNotFound) {
      buffer().Note(original.status());
    }
  }

  void RemoveImage(ImageId image) override { buffer().Note(RemoveStored(image)); }

  void PutGroundPoint(const GroundPoint& point) override {
    buffer().Put(Family::kMeta, GroundPointKey(point.name), Encode(point));
  }

  void DeleteGroundPoint(const std::string& name) override {
    buffer().Delete(Family::kMeta, GroundPointKey(name));
  }

  void PutToken(const TokenRecord& token) override {
    buffer().Put(Family::kMeta, TokenKey(token.number), Encode(token));
  }

  void PutHidden(const HiddenRecord& hidden) override {
    buffer().Put(Family::kMeta, HiddenKey(hidden.kind, hidden.number), Encode(hidden));
  }

  void DeleteHidden(HiddenKind kind, uint32_t number) override {
    buffer().Delete(Family::kMeta, HiddenKey(kind, number));
  }

  void PutReport(const ReportRecord& report) override {
    buffer().Put(Family::kMeta, ReportKey(report.number), Encode(report));
  }

  void PutContribution(const ContributionRecord& contribution) override {
    const Result<uint32_t> last = base_->contributing().LastContribution();
    buffer().Note(last.status());
    buffer().Put(Family::kContributions, ContributionKey(contribution.number),
                 Encode(contribution));
    if (last.ok() && contribution.number > *last)
      buffer().Put(Family::kContributions, LastContributionKey(),
                   std::string_view(EncodeU32(contribution.number)));
  }

  void PutContributedPhoto(const ContributedPhoto& photo) override {
    buffer().Put(Family::kContributions, ContributedPhotoKey(photo.contribution, photo.upload),
                 Encode(photo));
  }

  void RemoveContribution(uint32_t number) override {
    buffer().Delete(Family::kContributions, ContributionKey(number));
    buffer().Note(
        base_->contributing().ScanContributedPhotos(number, 0, [&](const ContributedPhoto& photo) {
          buffer().Delete(Family::kContributions, ContributedPhotoKey(number, photo.upload));
          return true;
        }));
  }

  void PutForbidden(const ForbiddenRecord& forbidden) override {
    buffer().Put(Family::kMeta, ForbiddenKey(forbidden.kind, forbidden.a, forbidden.b),
                 Encode(forbidden));
  }

  void DeleteForbidden(ForbiddenKind kind, uint32_t a, uint32_t b) override {
    buffer().Delete(Family::kMeta, ForbiddenKey(kind, std::min(a, b), std::max(a, b)));
  }

  void PutHypothesis(const HypothesisRecord& hypothesis) override {
    buffer().Put(Family::kMeta, HypothesisKey(hypothesis.a, hypothesis.b), Encode(hypothesis));
  }

  void DeleteHypothesis(ReconstructionId a, ReconstructionId b) override {
    buffer().Delete(Family::kMeta, HypothesisKey(std::min(a, b), std::max(a, b)));
  }

  void PutSubmap(const SubmapRecord& submap) override {
    buffer().Put(Family::kMeta, SubmapKey(submap.id), Encode(submap));
  }

  void DeleteSubmap(SubmapId id) override {
    buffer().Delete(Family::kMeta, SubmapKey(id));
    buffer().Delete(Family::kMeta, BorderKey(id));
  }

  void PutSubmapBorder(const SubmapBorder& border) override {
    buffer().Put(Family::kMeta, BorderKey(border.id), Encode(border));
  }

  void PutReconstruction(const ReconstructionRecord& reconstruction) override {
    buffer().Put(Family::kReconstructions, ReconstructionKey(reconstruction.id),
                 Encode(reconstruction));
    buffer().Delete(Family::kQueue,
                    PointBlocksMarkKey(reconstruction.id, reconstruction.points_generation));
  }

  void PutPose(const PoseRecord& pose) override {
    buffer().Put(Family::kPoses, ImageKey(pose.image), Encode(pose));
  }

  void DeletePose(ImageId image) override {
    buffer().Delete(Family::kPoses, ImageKey(image));
    buffer().Delete(Family::kObservations, ImageKey(image));
  }

  void PutObservations(ImageId image, std::span<const Observation> observations) override {
    if (observations.empty()) {
      buffer().Delete(Family::kObservations, ImageKey(image));
    } else {
      buffer().Put(Family::kObservations, ImageKey(image), Encode(observations));
    }
  }

  void PutPointBlock(ReconstructionId reconstruction, uint32_t generation,
                     const PointBlock& block) override {
    const std::string key = PointBlockKey(reconstruction, generation, block.home);
    if (block.points.empty() && block.next_ordinal == 1) {
      buffer().Delete(Family::kPoints, key);
    } else {
      buffer().Put(Family::kPoints, key, Encode(block));
    }
  }

  void DeletePointBlocks(ReconstructionId reconstruction, uint32_t generation) override {
    buffer().DeletePrefix(Family::kPoints, PointBlockPrefix(reconstruction, generation));
  }

  void PutWords(uint32_t generation, ImageId image, std::span<const WordId> words) override {
    buffer().Put(Family::kWords, WordsKey(generation, image), EncodeWords(words));
  }

  void AddPostings(uint32_t generation, std::span<const WordId> words, ImageId image) override {
    if (!image.valid()) return buffer().Note(Status::InvalidArgument("postings of image id 0"));
    MergePostings(generation, words, EncodeU32(image.value));
  }

  void RemoveWords(uint32_t generation, std::span<const WordId> words, ImageId image) override {
    if (!image.valid()) return buffer().Note(Status::InvalidArgument("words of image id 0"));
    buffer().Delete(Family::kWords, WordsKey(generation, image));
    MergePostings(generation, words, EncodePostingsRemoval(image));
  }

  void DeleteVocabulary(uint32_t generation) override { buffer().DeleteVocabulary(generation); }

  void AddJournal(const JournalRecord& record) override {
    buffer().Put(Family::kJournal, JournalKey(record.sequence), Encode(record));
  }

  DenseWriter& dense() override { return *dense_; }

  size_t size_bytes() const override { return buffer_ ? buffer_->size_bytes() : spent_size_bytes_; }

  Status Commit() override {
    if (!buffer_) return Status::InvalidArgument("a transaction commits only once");
    const Status status = Apply();
    // A spent transaction must not keep the database open.
    spent_size_bytes_ = buffer_->size_bytes();
    buffer_.reset();
    base_.reset();
    files_.reset();
    return status;
  }

 private:
  WriteBuffer& buffer() {
    VEDUTA_CHECK(buffer_.has_value(), "a transaction was written to after its Commit");
    return *buffer_;
  }

  void MergePostings(uint32_t generation, std::span<const WordId> words, std::string_view operand) {
    for (const WordId word : words)
      buffer().Merge(Family::kPostings, PostingsKey(generation, word), operand);
  }

  Status RemoveStored(ImageId id) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, base_->GetImage(id));
    VEDUTA_RETURN_IF_ERROR(count_changes_.NoteRemoval(*base_, id));
    buffer().Delete(Family::kImages, ImageKey(id));
    if (image.reason != Reason::kNameTaken)
      buffer().Delete(Family::kNames, NameKey(image.name, image.contributor));
    if (image.verdict == Verdict::kRejected) return Status::Ok();  // nothing else is kept of it
    DeletePhoto(image.photo);
    DeleteOriginal(id);
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, base_->ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) DeletePair(id, neighbor.image);
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, base_->GetState());
    if (state.vocabulary_generation == 0) return Status::Ok();
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words,
                            base_->GetWords(state.vocabulary_generation, id));
    RemoveWords(state.vocabulary_generation, words, id);
    return Status::Ok();
  }

  // The state record with the counts as they will be. Where the counts change, it is written even
  // if nobody has put it: so another transaction that changes them is a conflict.
  Status PutCountedState() {
    if (!state_ && count_changes_.empty()) return Status::Ok();
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState before, base_->GetState());
    if (!state_) state_ = before;
    state_->counts = count_changes_.ApplyTo(before.counts);
    buffer_->Put(Family::kMeta, kStateKey, Encode(*state_));
    return Status::Ok();
  }

  // With the commit mutex held, so that no submission of the same bytes writes in between.
  Status CheckWrittenAhead() {
    for (const ContentHash& photo : kept_photos_) VEDUTA_RETURN_IF_ERROR(claims_->CheckKept(photo));
    for (const auto& [photo, features] : kept_features_) {
      if (claims_->HasOtherFeatures(photo))
        buffer_->Put(Family::kFeatures, HashKey(photo), Encode(*features));
    }
    return buffer_->status();
  }

  Status Apply() {
    VEDUTA_RETURN_IF_ERROR(buffer_->status());
    VEDUTA_RETURN_IF_ERROR(PutCountedState());
    VEDUTA_RETURN_IF_ERROR(buffer_->status());
    VEDUTA_RETURN_IF_ERROR(files_->Commit(buffer_->batch(), state_.has_value(), state_version_,
                                          [this] { return CheckWrittenAhead(); }));
    for (const ContentHash& photo : kept_photos_) claims_->Forget(photo);
    return Status::Ok();
  }

  std::shared_ptr<DatabaseFiles> files_;
  const std::shared_ptr<PhotoClaims> claims_;
  // In this order: what is committed after the version was read is a conflict or in the snapshot.
  const uint64_t state_version_;
  std::shared_ptr<const Snapshot> base_;  // none once spent
  std::optional<DatabaseState> state_;
  CountChanges count_changes_;
  std::optional<WriteBuffer> buffer_;  // none once spent
  std::unique_ptr<DenseWriter> dense_;
  size_t spent_size_bytes_ = 0;
  std::vector<ContentHash> kept_photos_;
  std::vector<std::pair<ContentHash, std::shared_ptr<const Features>>> kept_features_;
};

}  // namespace

std::unique_ptr<Transaction> MakeTransaction(std::shared_ptr<DatabaseFiles> files,
                                             std::shared_ptr<PhotoClaims> claims) {
  return std::make_unique<WriteTransaction>(std::move(files), std::move(claims));
}

}  // namespace veduta
