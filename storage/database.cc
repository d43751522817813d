// SPDX-License-Identifier: Apache-2.0
#include "storage/database.h"

#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>

#include "storage/database_files.h"
#include "storage/maintenance.h"
#include "storage/moderation_view.h"
#include "storage/partial_uploads.h"
#include "storage/purge.h"
#include "storage/record_counts.h"
#include "storage/records/state_record.h"
#include "storage/snapshot_view.h"
#include "storage/uploads.h"
#include "storage/write_ahead.h"
#include "storage/write_buffer.h"
#include "storage/write_transaction.h"

namespace veduta {
namespace {

// Writes the counts into a state record that has none: an older program wrote it. One synced batch:
// whoever is killed on the way counts again when the database is next opened.
Status CountOnce(const std::shared_ptr<DatabaseFiles>& files) {
  const std::shared_ptr<const Snapshot> snapshot = MakeSnapshot(files);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot->GetState());
  if (state.counts) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(state.counts, CountRecords(*snapshot));
  WriteBuffer batch(*files);
  batch.Put(Family::kMeta, kStateKey, Encode(state));
  return batch.Write(/*sync=*/true, "count the records of the database at " + files->path());
}

Result<std::shared_ptr<DatabaseFiles>> OpenFiles(const std::string& path,
                                                 const DatabaseOptions& options,
                                                 PhotoClaims& claims) {
  VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<DatabaseFiles> files, DatabaseFiles::Open(path, options));
  if (options.read_only) return files;
  VEDUTA_RETURN_IF_ERROR(SweepWriteAheads(*files, claims));
  VEDUTA_RETURN_IF_ERROR(CountOnce(files));
  return files;
}

class DatabaseView final : public Database {
 public:
  DatabaseView(std::shared_ptr<DatabaseFiles> files, const DatabaseOptions& options,
               std::shared_ptr<PhotoClaims> claims)
      : options_(options), claims_(std::move(claims)), files_(std::move(files)) {
    options_.create = false;  // when it is opened again
  }

  std::shared_ptr<const Snapshot> GetSnapshot() const override { return MakeSnapshot(files()); }
  std::unique_ptr<Transaction> BeginTransaction() override {
    return MakeTransaction(files(), claims_);
  }

  Status Reopen() override {
    const std::lock_guard one_at_a_time(reopen_mutex_);
    const std::shared_ptr<DatabaseFiles> closed = files();
    const std::string path = closed->path();
    const Reopening until_it_ends(this);
    closed->Close(Status::Busy("the database at " + path + " was opened again: ask again"));
    Result<std::shared_ptr<DatabaseFiles>> opened = OpenFiles(path, options_, *claims_);
    if (!opened.ok()) {
      closed->Explain(Status::Busy("the database at " + path +
                                   " could not be opened again: " + opened.status().message()));
      return opened.status();
    }
    const std::lock_guard lock(files_mutex_);
    files_ = std::move(*opened);
    return Status::Ok();
  }

  Status WritePhotoAhead(const ContentHash& photo, std::span<const uint8_t> bytes,
                         const Features& features, const PhotoName& name) override {
    return veduta::WritePhotoAhead(*files(), *claims_, photo, bytes, features, name);
  }
  Status DropPhotoAhead(const ContentHash& photo) override {
    return veduta::DropPhotoAhead(*files(), *claims_, photo);
  }
  Status DropPointBlocksAhead(ReconstructionId reconstruction, uint32_t generation) override {
    return veduta::DropPointBlocksAhead(*files(), reconstruction, generation);
  }
  Status DropVocabularyAhead(uint32_t generation) override {
    return veduta::DropVocabularyAhead(*files(), generation);
  }
  Status WritePointBlocksAhead(ReconstructionId reconstruction, uint32_t generation,
                               std::span<const PointBlock> blocks) override {
    return veduta::WritePointBlocksAhead(*files(), reconstruction, generation, blocks);
  }
  Status WriteVocabularyAhead(uint32_t generation, std::span<const uint8_t> tree) override {
    return veduta::WriteVocabularyAhead(*files(), generation, tree);
  }
  Status WriteWordsAhead(uint32_t generation, ImageId image,
                         std::span<const WordId> words) override {
    return veduta::WriteWordsAhead(*files(), generation, image, words);
  }
  Status WritePostingsAhead(uint32_t generation, WordId word,
                            std::span<const ImageId> images) override {
    return veduta::WritePostingsAhead(*files(), generation, word, images);
  }

  Result<uint64_t> AddUpload(UploadRecord upload, std::span<const uint8_t> bytes) override {
    const std::lock_guard one_at_a_time(uploads_mutex_);
    return veduta::AddUpload(*files(), std::move(upload), bytes, options_.sync_wal);
  }
  Status NameUploadCamera(uint64_t number, const std::string& camera) override {
    const std::lock_guard one_at_a_time(uploads_mutex_);
    return veduta::NameUploadCamera(*files(), number, camera, options_.sync_wal);
  }
  Status DeleteUpload(uint64_t number, const ContributedPhoto* fate) override {
    return veduta::DeleteUpload(*files(), number, fate);
  }

  Status PutPartialUpload(const PartialUploadRecord& partial) override {
    return veduta::PutPartialUpload(*files(), partial, options_.sync_wal);
  }
  Status AppendToPartialUpload(std::span<const uint8_t> bytes,
                               PartialUploadRecord* partial) override {
    return veduta::AppendToPartialUpload(*files(), bytes, options_.sync_wal, partial);
  }
  Status FinishPartialUpload(std::span<const uint8_t> photo, UploadRecord* upload,
                             PartialUploadRecord* partial) override {
    const std::lock_guard one_at_a_time(uploads_mutex_);
    return veduta::FinishPartialUpload(*files(), photo, options_.sync_wal, upload, partial);
  }
  Status DeletePartialUpload(const PartialUploadRecord& partial) override {
    return veduta::DeletePartialUpload(*files(), partial);
  }

  Status PutTokenUse(std::span<const TokenUse> uses) override {
    return veduta::PutTokenUse(*files(), uses);
  }

  Result<DatabaseSizes> GetSizes() const override { return SizesOf(*files()); }
  Result<DatabaseStatistics> GetStatistics() const override { return StatisticsOf(*files()); }
  Status CreateCheckpoint(const std::string& path) override {
    return MakeCheckpoint(*files(), path);
  }
  Status CheckCheckpoint(const std::string& path, std::stop_token stop) const override {
    return veduta::CheckCheckpoint(*files(), path, stop);
  }
  Status Compact() override { return CompactFiles(*files()); }
  Status PurgeDeleted() override { return PurgeDeletedFrom(*files(), kPurgeWait); }

 private:
  // While it lives, whoever asks for the files waits.
  class Reopening {
   public:
    explicit Reopening(DatabaseView* view) : view_(view) { Set(true); }
    ~Reopening() {
      Set(false);
      view_->reopened_.notify_all();
    }
    Reopening(const Reopening&) = delete;
    Reopening& operator=(const Reopening&) = delete;

   private:
    void Set(bool is_reopening) {
      const std::lock_guard lock(view_->files_mutex_);
      view_->is_reopening_ = is_reopening;
    }
    DatabaseView* const view_;
  };

  std::shared_ptr<DatabaseFiles> files() const {
    std::unique_lock lock(files_mutex_);
    reopened_.wait(lock, [this] { return !is_reopening_; });
    return files_;
  }

  DatabaseOptions options_;
  const std::shared_ptr<PhotoClaims> claims_;
  std::mutex reopen_mutex_;
  std::mutex uploads_mutex_;
  mutable std::mutex files_mutex_;
  mutable std::condition_variable reopened_;
  bool is_reopening_ = false;             // guarded by files_mutex_
  std::shared_ptr<DatabaseFiles> files_;  // guarded by files_mutex_; never null
};

}  // namespace

Result<std::unique_ptr<Database>> Database::Open(const std::string& path,
                                                 const DatabaseOptions& options) {
  auto claims = std::make_shared<PhotoClaims>();
  VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<DatabaseFiles> files, OpenFiles(path, options, *claims));
  return std::unique_ptr<Database>(
      std::make_unique<DatabaseView>(std::move(files), options, std::move(claims)));
}

}  // namespace veduta
