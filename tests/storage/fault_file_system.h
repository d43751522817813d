// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file system for crash tests: it fails chosen operations and forgets what was never synced, as a
// power cut would.
//
//   auto fs = std::make_shared<FaultFileSystem>();
//   options.file_system = fs;
//   fs->FailWrites(n, Fault::kIoError, 1);           // the n-th write operation from now, no other
//   fs->FailWrites(n, Fault::kNoSpace, FaultFileSystem::kForever);  // and every later one
//   fs->Fail(Only(Operation::kRead), n, Fault::kIoError, 1);        // the n-th read
//   ... use the database, note what it acknowledges, destroy it (and its snapshots) ...
//   fs->Heal();               // then open it again: a crash of the process
//
//   fs->CutPower();           // nothing becomes durable from here on, whatever is still running
//   ... destroy the database ...
//   fs->DropUnsyncedData();   // the disk as the next boot finds it; heals too
//   fs->LoseUnsyncedData(seed);  // another such disk
//   ... open it again ...
//
// Operation (fault_disk.h) says what counts as one. A failing append first writes half of its
// bytes, so that torn records occur. A read fails as a whole: RocksDB does not expect less.
//
// What a power cut leaves at its worst (DropUnsyncedData): of every file, the bytes up to its last
// sync; of every folder, the entries it had at its last sync: files, folders and links that were
// made since are gone, renames are undone (with the content that they replaced). Deletions are
// durable at once, which is the worst case for who deletes before syncing.
//
// What it leaves otherwise (LoseUnsyncedData), each thing by itself as the seed says: an unsynced
// tail of a file has any length up to its own, and any of its pages of 4 KiB are zeros, or end in
// zeros; of pages that were written in place, each is the old one, the new one, or a part of both;
// a file that was made, renamed or deleted in a folder that was not synced since is so, or not.
// Only a file that was cut to nothing stays so.
//
// Syncs are not passed on to the real disk: a test needs no durability of its own, and they are
// what takes time. Logs for people (NewLogger) and the lock are not tracked. Thread-safe, but for
// the two functions that make the disk of the next boot, which want every file closed.

#include <rocksdb/file_system.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <string>

#include "tests/storage/fault_disk.h"

namespace veduta {

class FaultFileSystem final : public rocksdb::FileSystemWrapper {
 public:
  static constexpr uint64_t kForever = std::numeric_limits<uint64_t>::max();

  FaultFileSystem()
      : FileSystemWrapper(rocksdb::FileSystem::Default()), disk_(std::make_shared<FaultDisk>()) {}
  const char* Name() const override { return "FaultFileSystem"; }

  // The n-th operation of these kinds from now (n >= 1) and the `count` - 1 after it fail. Replaces
  // what was said before.
  void Fail(Operations kinds, uint64_t n, Fault fault, uint64_t count) {
    disk_->Fail(kinds, n, fault, count);
  }
  void FailWrites(uint64_t n, Fault fault, uint64_t count) {
    Fail(kWriteOperations, n, fault, count);
  }
  // Every operation but reads fails until Heal or the disk of the next boot is made.
  void CutPower() { disk_->CutPower(); }
  void Heal() { disk_->Heal(); }
  // Operations so far, failed ones included (but for those after CutPower).
  OperationCounts counts() const { return disk_->counts(); }
  uint64_t write_count() const {
    const OperationCounts counts = disk_->counts();
    uint64_t sum = 0;
    for (size_t i = 0; i < counts.size(); ++i) sum += (kWriteOperations >> i & 1) * counts[i];
    return sum;
  }
  // How many have failed by Fail since it was called.
  OperationCounts faults() const { return disk_->faults(); }
  uint64_t fault_count() const {
    const OperationCounts faults = disk_->faults();
    return std::accumulate(faults.begin(), faults.end(), uint64_t{0});
  }
  // Turn the disk into what a power cut would have left, and heal.
  void DropUnsyncedData() { disk_->CutShort(std::nullopt); }
  void LoseUnsyncedData(uint64_t seed) { disk_->CutShort(seed); }

  rocksdb::IOStatus NewSequentialFile(const std::string& name, const rocksdb::FileOptions& options,
                                      std::unique_ptr<rocksdb::FSSequentialFile>* result,
                                      rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewRandomAccessFile(const std::string& name,
                                        const rocksdb::FileOptions& options,
                                        std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
                                        rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewRandomRWFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSRandomRWFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus GetChildren(const std::string& name, const rocksdb::IOOptions& options,
                                std::vector<std::string>* result,
                                rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus GetFileSize(const std::string& name, const rocksdb::IOOptions& options,
                                uint64_t* size, rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus ReopenWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                                       std::unique_ptr<rocksdb::FSWritableFile>* result,
                                       rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus ReuseWritableFile(const std::string&, const std::string&,
                                      const rocksdb::FileOptions&,
                                      std::unique_ptr<rocksdb::FSWritableFile>*,
                                      rocksdb::IODebugContext*) override {
    return rocksdb::IOStatus::NotSupported("FaultFileSystem does not reuse files");
  }
  rocksdb::IOStatus NewDirectory(const std::string& name, const rocksdb::IOOptions& options,
                                 std::unique_ptr<rocksdb::FSDirectory>* result,
                                 rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus Truncate(const std::string& name, size_t size,
                             const rocksdb::IOOptions& options,
                             rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus CreateDir(const std::string& name, const rocksdb::IOOptions& options,
                              rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus CreateDirIfMissing(const std::string& name, const rocksdb::IOOptions& options,
                                       rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus RenameFile(const std::string& from, const std::string& to,
                               const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;
  rocksdb::IOStatus LinkFile(const std::string& from, const std::string& to,
                             const rocksdb::IOOptions& options,
                             rocksdb::IODebugContext* debug) override;

 private:
  class SequentialFile;
  class RandomAccessFile;
  class RandomRWFile;
  class File;
  class Folder;

  // Counts a read, under the mutex.
  static rocksdb::IOStatus BeginRead(FaultDisk& disk) {
    const std::lock_guard lock(disk.mutex());
    return disk.Begin(Operation::kRead);
  }

  const std::shared_ptr<FaultDisk> disk_;
};

}  // namespace veduta
