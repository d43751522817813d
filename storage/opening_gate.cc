// SPDX-License-Identifier: Apache-2.0
#include "storage/opening_gate.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "storage/marker_file.h"

namespace veduta {
namespace {

// An opening takes milliseconds, and a second where there are thousands of files. Chosen by hand.
constexpr std::chrono::seconds kPatience(5);
constexpr std::chrono::milliseconds kBetweenAttempts(1);

// Bytes of the file VEDUTA; it need not be so long.
enum class Lock : off_t {
  kTurn = 0,  // a reader that comes shares it for a moment; a writer that waits has it alone
  kFiles = 1  // readers that open share it; a writer that deletes has it alone
};

// Locks of the open file, not of the process: two of one process count as two.
bool Set(int file, Lock lock, short type) {
  struct flock request = {};
  request.l_type = type;
  request.l_whence = SEEK_SET;
  request.l_start = static_cast<off_t>(lock);
  request.l_len = 1;
  return fcntl(file, F_OFD_SETLK, &request) == 0;
}

// Takes kTurn and then kFiles. The kernel has no wait with an end.
bool Take(int file, short type, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  for (const Lock lock : {Lock::kTurn, Lock::kFiles}) {
    while (!Set(file, lock, type)) {
      if ((errno != EAGAIN && errno != EACCES) || std::chrono::steady_clock::now() >= end)
        return false;
      std::this_thread::sleep_for(kBetweenAttempts);
    }
  }
  return true;
}

int OpenAndTake(const std::string& folder, int flags, short type,
                std::chrono::milliseconds patience) {
  const int file = open((folder + "/" + kMarkerFile).c_str(), flags | O_CLOEXEC);
  if (file < 0 || Take(file, type, patience)) return file;
  close(file);
  return -1;
}

}  // namespace

OpeningGate OpeningGate::EnterToOpen(const std::string& folder) {
  OpeningGate gate(OpenAndTake(folder, O_RDONLY, F_RDLCK, kPatience));
  if (gate.is_held()) Set(gate.file_, Lock::kTurn, F_UNLCK);
  return gate;
}

OpeningGate OpeningGate::EnterToDelete(const std::string& folder, bool waits) {
  return OpeningGate(
      OpenAndTake(folder, O_RDWR, F_WRLCK, waits ? kPatience : std::chrono::milliseconds(0)));
}

OpeningGate::~OpeningGate() {
  if (is_held()) close(file_);
}

rocksdb::IOStatus GatedDeletions::DeleteFile(const std::string& name,
                                             const rocksdb::IOOptions& options,
                                             rocksdb::IODebugContext* debug) {
  const std::lock_guard lock(mutex_);
  const OpeningGate gate = OpeningGate::EnterToDelete(folder_, waits_);
  waits_ = gate.is_held();
  return target()->DeleteFile(name, options, debug);
}

}  // namespace veduta
