// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keeps the files of a database from being deleted while a reader opens it.
//
// A reader reads the list of the files and then opens each of them. A writer that compacts all the
// time, on a busy machine, deletes some of them in between, every time that the reader tries. So a
// reader holds the gate while it opens, some milliseconds, and a writer that deletes a file waits
// for it. Both hold locks on bytes of the file VEDUTA, which the kernel lets go of when a process
// ends. Nobody is kept waiting for ever: a writer that waits lets no further reader in before it,
// and who has waited for long goes on without the gate.

#include <rocksdb/file_system.h>

#include <memory>
#include <mutex>
#include <string>

namespace veduta {

class OpeningGate final {
 public:
  // Where the locks cannot be had (another file system, a wait of more than 5 s), holds nothing.
  static OpeningGate EnterToOpen(const std::string& folder);
  // Waits for 5 s at most; where `waits` is false, not at all.
  static OpeningGate EnterToDelete(const std::string& folder, bool waits);

  OpeningGate(OpeningGate&& other) noexcept : file_(other.file_) { other.file_ = -1; }
  OpeningGate& operator=(OpeningGate&&) = delete;
  ~OpeningGate();
  bool is_held() const { return file_ >= 0; }

 private:
  explicit OpeningGate(int file) : file_(file) {}
  int file_;  // closing it lets go of the locks; -1: none
};

// A writer's file system, whose deletions wait for readers that are opening. Thread-safe.
class GatedDeletions final : public rocksdb::FileSystemWrapper {
 public:
  GatedDeletions(const std::shared_ptr<rocksdb::FileSystem>& target, std::string folder)
      : FileSystemWrapper(target), folder_(std::move(folder)) {}
  const char* Name() const override { return "veduta.GatedDeletions"; }
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* debug) override;

 private:
  const std::string folder_;
  std::mutex mutex_;   // so that deletions do not wait for each other at the gate
  bool waits_ = true;  // not behind a reader that was waited for in vain
};

}  // namespace veduta
