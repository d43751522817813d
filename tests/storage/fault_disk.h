// SPDX-License-Identifier: Apache-2.0
#pragma once
// What FaultFileSystem knows of the disk: which operations are to fail, and what is not durable
// yet. Its power cut edits the files, so they must lie on the operating system's file system.

#include <rocksdb/io_status.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/content_hash.h"  // SeededRandom

namespace veduta {

enum class Fault { kIoError, kNoSpace };

// kCreate: a file, a folder or a link. kWrite: an append or a truncation. kOverwrite: a write in
// place. kSync: of a file or a folder. kRead: opening for reading, reading, listing a folder,
// asking for a size.
enum class Operation : uint8_t { kCreate, kWrite, kOverwrite, kSync, kRename, kDelete, kRead };
inline constexpr size_t kOperationKinds = 7;
const char* OperationName(Operation operation);

// A set of kinds of operations.
using Operations = uint32_t;
constexpr Operations Only(Operation operation) {
  return 1u << static_cast<uint32_t>(operation);
}
inline constexpr Operations kAllOperations = (1u << kOperationKinds) - 1;
// What nobody may pass over when it fails. Deletions and overwriting are not among them: RocksDB
// deletes again later, and what is overwritten is the file ACKNOWLEDGED (storage/acknowledged.h).
inline constexpr Operations kWriteOperations = Only(Operation::kCreate) | Only(Operation::kWrite) |
                                               Only(Operation::kSync) | Only(Operation::kRename);

using OperationCounts = std::array<uint64_t, kOperationKinds>;

// Thread-safe, but for CutShort, which wants every file closed.
class FaultDisk final {
 public:
  // The bytes of a file, whatever its names are.
  struct Content {
    ~Content();
    uint64_t size = 0;
    uint64_t synced = 0;
    // Of what was written in place since the last sync: each page as it was then, by its number.
    std::map<uint64_t, std::string> pages_before;
    std::string spare;  // a further link to the bytes, which outlives the names; or empty
  };

  FaultDisk() = default;
  ~FaultDisk();
  FaultDisk(const FaultDisk&) = delete;
  FaultDisk& operator=(const FaultDisk&) = delete;

  // The n-th operation of these kinds from now (n >= 1) and the `count` - 1 after it fail.
  void Fail(Operations kinds, uint64_t n, Fault fault, uint64_t count);
  void CutPower();
  void Heal();
  OperationCounts counts() const;
  OperationCounts faults() const;  // those that have failed by Fail since it was called

  // What a power cut leaves, and heals. Without a seed the worst for who forgets a sync: nothing
  // unsynced is left, and deletions are durable. With one, each thing that is not durable is kept
  // or lost by itself.
  void CutShort(std::optional<uint64_t> seed);

  // The following are for the file system, which holds the mutex.
  std::mutex& mutex() const { return mutex_; }
  // Counts an operation; an error where it is to fail.
  rocksdb::IOStatus Begin(Operation operation);
  bool power_is_out() const { return power_is_out_; }
  static std::string Normal(const std::string& path);
  // Of a file that is there; one that is not known yet is durable.
  std::shared_ptr<Content> Track(const std::string& path);
  // A new file of no bytes, or an old one that lost them.
  std::shared_ptr<Content> StartAnew(const std::string& path, bool is_new);
  void FolderMade(const std::string& path);
  void Linked(const std::string& from, const std::string& to);
  // Called before it happens; `Undo` takes it back where it then fails.
  void BeforeDelete(const std::string& path);
  void BeforeRename(const std::string& from, const std::string& to);
  void UndoLast();
  void Happened();  // the deletion or renaming
  void BeforeOverwrite(const std::string& path, Content* content, uint64_t begin, uint64_t end);
  void FolderSynced(const std::string& path);

 private:
  // A change of a folder's entries.
  struct Change {
    enum Kind { kMade, kFolderMade, kRenamed, kFolderRenamed, kDeleted } kind;
    std::string path;  // made, renamed to, deleted
    std::string renamed_from;
    std::shared_ptr<Content> content;   // none for a folder
    std::shared_ptr<Content> replaced;  // what the renaming wrote over
  };
  using Entries = std::map<std::string, std::shared_ptr<Content>>;

  void KeepSpare(const std::string& path, Content* content);
  void MoveTracked(const std::string& from, const std::string& to);
  Entries EntriesAfter(const std::vector<bool>& kept) const;
  void SetEntries(const Entries& entries);
  void UndoFolders(const std::vector<bool>& kept);

  mutable std::mutex mutex_;
  Fault fault_ = Fault::kIoError;
  Operations failing_ = 0;
  uint64_t seen_ = 0, first_failing_ = 0, failing_count_ = 0;
  OperationCounts counts_{}, faults_{};
  bool power_is_out_ = false;
  std::string spare_folder_;  // made when it is needed
  uint64_t spare_count_ = 0;
  Entries files_;                // that were opened for writing, or whose name has changed
  std::vector<Change> changes_;  // that are not durable, in order
};

// One bit of one file at rest.
struct BitFlip {
  std::string path;
  uint64_t byte = 0;
  int bit = 0;
};
// Of a file in this folder, not of one below it: any file that has bytes, as likely as any other.
BitFlip ChooseBitFlip(const std::string& folder, SeededRandom* random);
void Apply(const BitFlip& flip);  // a second time undoes it

}  // namespace veduta
