// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file system for crash tests: it fails chosen writes and forgets what was never synced, as a
// power cut would.
//
//   auto fs = std::make_shared<FaultFileSystem>();          options.file_system = fs;
//   fs->FailWrites(n, Fault::kIoError, 1);                  // the n-th write operation from now
//   fails, no other fs->FailWrites(n, Fault::kNoSpace, FaultFileSystem::kForever);   // ... and
//   every later one: a full disk
//   ... use the database, note what it acknowledges, destroy it (and its snapshots) ...
//   fs->Heal();                                             // open it again: a crash of the
//   process
//
//   fs->CutPower();           // nothing becomes durable from here on, whatever is still running
//   ... destroy the database ...
//   fs->DropUnsyncedData();   // the disk as the next boot finds it; heals too
//   ... open it again ...
//
// What counts as one write operation: creating (or truncating, or linking) a file, creating a
// folder, renaming, every append and truncation, every sync of a file or folder. Deletions are not
// counted: they fail only while the power is out. A failing append first writes half of its bytes,
// so that torn records occur.
//
// What a power cut leaves: of every file, the bytes up to its last sync; of every folder, the
// entries it had at its last sync: files, folders and links that were made since are gone, renames
// are undone (with the content that they replaced). Deletions count as durable at once, which is
// the worst case for who deletes before syncing.
//
// Syncs are not passed on to the real disk: a test needs no durability of its own, and they are
// what takes time. The base must be the operating system's file system (DropUnsyncedData edits the
// files themselves). Files that were there before, and logs for people (NewLogger), are not
// tracked. Thread-safe, but for DropUnsyncedData, which wants every file closed.

#include <rocksdb/file_system.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace veduta {

enum class Fault { kIoError, kNoSpace };

class FaultFileSystem final : public rocksdb::FileSystemWrapper {
 public:
  static constexpr uint64_t kForever = std::numeric_limits<uint64_t>::max();

  FaultFileSystem()
      : FileSystemWrapper(rocksdb::FileSystem::Default()), disk_(std::make_shared<Disk>()) {}
  const char* Name() const override { return "FaultFileSystem"; }

  // The n-th write operation from now (n >= 1) and the `count - 1` after it fail.
  void FailWrites(uint64_t n, Fault fault, uint64_t count) {
    const std::lock_guard lock(disk_->mutex);
    disk_->fault = fault;
    disk_->first_failing = disk_->write_count + n;
    disk_->failing_count = count;
    disk_->fault_count = 0;
  }
  // Every write and deletion fails until Heal or DropUnsyncedData.
  void CutPower() {
    const std::lock_guard lock(disk_->mutex);
    disk_->power_out = true;
  }
  void Heal() {
    const std::lock_guard lock(disk_->mutex);
    disk_->power_out = false;
    disk_->failing_count = 0;
  }
  // Write operations so far, failed ones included (but for those after CutPower).
  uint64_t write_count() const {
    const std::lock_guard lock(disk_->mutex);
    return disk_->write_count;
  }
  // How many have failed by FailWrites since it was called.
  uint64_t fault_count() const {
    const std::lock_guard lock(disk_->mutex);
    return disk_->fault_count;
  }
  // Turns the disk into what a power cut would have left, and heals.
  void DropUnsyncedData();

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
  struct FileLength {
    uint64_t size = 0;
    uint64_t synced = 0;
  };
  // A change of a folder that is not durable yet.
  struct Change {
    std::string path;                     // made, or renamed to
    std::string renamed_from;             // empty when made
    std::optional<std::string> replaced;  // what the rename wrote over
  };
  struct Disk {
    mutable std::mutex mutex;
    Fault fault = Fault::kIoError;
    uint64_t write_count = 0, first_failing = 0, failing_count = 0, fault_count = 0;
    bool power_out = false;
    std::map<std::string, std::shared_ptr<FileLength>> files;  // that were opened for writing
    std::vector<Change> changes;                               // in order

    rocksdb::IOStatus Count();
    static std::string Folder(const std::string& path) {
      return Normal(path).parent_path().string();
    }
    static std::filesystem::path Normal(const std::string& path);
    void Made(const std::string& path);
    void MoveTracked(const std::string& from, const std::string& to);
  };
  class File;
  class Folder;

  static std::optional<std::string> ReadAll(const std::string& path);

  const std::shared_ptr<Disk> disk_;
};

}  // namespace veduta
