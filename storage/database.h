// SPDX-License-Identifier: Apache-2.0
#pragma once
// The database's files: typed access to every record family over RocksDB.
//
//   Database     one handle, shared by all threads of the one process that has it open
//   Snapshot     an unchanging view; readers never wait for writers
//   Transaction  writes that become visible and durable together, or not at all
//
// What a snapshot returns owns its bytes: it stays valid when the snapshot and the database go.
//
// Snapshots, and transactions that are not committed, keep the files open and locked after their
// Database is gone: closing is complete when the last of them goes. They do not hold up
// Database::Reopen: it closes the files under them, and from then on each use of them is kBusy.
//
// Every function is thread-safe unless it says otherwise. Errors: kIoError with the operating
// system's word (a full disk is named as such), kCorruption naming family and key, kNotFound naming
// what was asked for.

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "storage/base/status.h"
#include "storage/database_options.h"
#include "storage/database_sizes.h"
#include "storage/model/features.h"
#include "storage/model/partial_upload.h"
#include "storage/model/points.h"
#include "storage/model/upload.h"
#include "storage/snapshot.h"
#include "storage/transaction.h"

namespace veduta {

class Database {
 public:
  // kNotFound where there is no database, kBusy when another process has it open, kCorruption when
  // it is damaged or its format is not ours (saying which versions). A damaged log is noticed
  // before anything is changed (storage/log_inspection.h). Sweeps what a crash left half-written.
  // kInvalidArgument for options outside their bounds.
  static Result<std::unique_ptr<Database>> Open(const std::string& path,
                                                const DatabaseOptions& options);
  virtual ~Database() = default;

  virtual std::shared_ptr<const Snapshot> GetSnapshot() const = 0;
  virtual std::unique_ptr<Transaction> BeginTransaction() = 0;

  // Closes the files and opens them again, as is necessary after a failed write: all that was
  // acknowledged is there then. Waits for reads and writes that are running, each of which is short
  // (a checkpoint's links, or one family's compaction), not for whoever holds a snapshot or a
  // transaction; all other functions wait for its end. Snapshots and transactions made before are
  // of no use afterwards: a scan ends at its next record, and every function fails with kBusy, "the
  // database was opened again: ask again". Photos written
  // ahead stay; what else was written ahead and not committed is deleted. Where opening fails, the
  // database stays closed, every use fails with kBusy and says why, and Reopen may be called again.
  virtual Status Reopen() = 0;

  // Writes ahead of a commit: a photo and its features, marked so that the next Open deletes them
  // unless an image with this photo has been committed by then. Writes nothing for a photo that is
  // committed already. Whoever writes ahead drops it when the commit has not come, so that a
  // process that runs for long keeps nothing that belongs to no image: WrittenAhead
  // (storage/written_ahead.h) does so by itself.
  // Where the commit is lost with a damaged log, a repair finds the photo under `name`.
  virtual Status WritePhotoAhead(const ContentHash& photo, std::span<const uint8_t> bytes,
                                 const Features& features, const PhotoName& name = {}) = 0;
  // Takes back one WritePhotoAhead when the photo turned out not to be wanted: removes both unless
  // an image with this photo has been committed, or another WritePhotoAhead of the same bytes has
  // not been taken back.
  virtual Status DropPhotoAhead(const ContentHash& photo) = 0;
  // Deletes point blocks, or the tree, words and postings of a vocabulary, that were written ahead
  // and that no commit has named; does nothing where one has, or where nothing was written.
  virtual Status DropPointBlocksAhead(ReconstructionId reconstruction, uint32_t generation) = 0;
  virtual Status DropVocabularyAhead(uint32_t generation) = 0;
  // Point blocks of a generation that no record names yet; Open deletes those that stay unnamed.
  virtual Status WritePointBlocksAhead(ReconstructionId reconstruction, uint32_t generation,
                                       std::span<const PointBlock> blocks) = 0;
  // Vocabulary tree, words and postings of a generation that is not active yet; Open deletes those
  // of a generation that has not become active. Images are added to those that a word's list has.
  virtual Status WriteVocabularyAhead(uint32_t generation, std::span<const uint8_t> tree) = 0;
  virtual Status WriteWordsAhead(uint32_t generation, ImageId image,
                                 std::span<const WordId> words) = 0;
  virtual Status WritePostingsAhead(uint32_t generation, WordId word,
                                    std::span<const ImageId> images) = 0;

  // Keeps a photo that waits for its turn, durably where the database syncs its log; it is no part
  // of the city, and enters no digest. It is entered in its contribution, where that is there, and
  // counted once. Its number, which is the next one where `upload` has none.
  virtual Result<uint64_t> AddUpload(UploadRecord upload, std::span<const uint8_t> bytes) = 0;
  // Gives a photo that waits the camera of that name; kNotFound. Otherwise as AddUpload.
  virtual Status NameUploadCamera(uint64_t number, const std::string& camera) = 0;
  // Once it has had its turn, with what became of it where it is a part of a contribution. Not
  // durable by itself; does nothing where there is none.
  virtual Status DeleteUpload(uint64_t number, const ContributedPhoto* fate = nullptr) = 0;

  // A photo that arrives in parts. `partial` is the stored record, and is changed to what is stored
  // then; each write is durable where the database syncs its log, and one call at a time may be
  // made. The caller has seen to it that the bytes are those that come next, that they are not all
  // that are missing, and of `photo`, that it is the whole.
  virtual Status PutPartialUpload(const PartialUploadRecord& partial) = 0;
  virtual Status AppendToPartialUpload(std::span<const uint8_t> bytes,
                                       PartialUploadRecord* partial) = 0;
  // As AddUpload, in the same write in which the parts are given up: the photo gets in line once.
  virtual Status FinishPartialUpload(std::span<const uint8_t> photo, UploadRecord* upload,
                                     PartialUploadRecord* partial) = 0;
  virtual Status DeletePartialUpload(const PartialUploadRecord& partial) = 0;  // not durable

  // Replaces what is known of these tokens' use. Not durable by itself: a killed process loses none
  // of it, a power cut may.
  virtual Status PutTokenUse(std::span<const TokenUse> uses) = 0;

  virtual Result<DatabaseSizes> GetSizes() const = 0;
  virtual Result<DatabaseStatistics> GetStatistics() const = 0;
  // A consistent copy that opens on its own: linked where possible. Nothing of it is read.
  virtual Status CreateCheckpoint(const std::string& path) = 0;
  // Reads all of such a copy once by its checksums. Where it cannot be read, deletes it and says
  // what is damaged; deletes it also where it is stopped: kCancelled, after the value at hand or,
  // at the end, after the tables. Others may write to the database meanwhile.
  virtual Status CheckCheckpoint(const std::string& path, std::stop_token stop = {}) const = 0;
  // Flushes memtables and merges files; for benchmarks and before a backup.
  virtual Status Compact() = 0;
  // Rewrites the files without what was deleted: afterwards none has bytes of a photo that was
  // removed before. O(database), without blob files that are younger than all that was deleted.
  // RocksDB's manifest may have the names of removed photos until the database is opened again.
  // kBusy while somebody holds a snapshot or a transaction from before the call: their bytes stay,
  // and it may be called again.
  virtual Status PurgeDeleted() = 0;
};

}  // namespace veduta
