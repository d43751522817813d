// SPDX-License-Identifier: Apache-2.0
#include "cli/service/disk_keeper.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

#include "storage/base/memory_shortage.h"

namespace veduta {
namespace {

// Between two attempts. Chosen by hand: opening takes some tenths of that.
constexpr std::chrono::seconds kPause(2);
// That the disk must have room for before: more than opening writes. Chosen by hand.
constexpr off_t kRoomBytes = 16 << 20;

}  // namespace

DiskKeeper::DiskKeeper(Engine* engine, std::string path, std::function<void()> reopened)
    : engine_(engine),
      path_(std::move(path)),
      reopened_(std::move(reopened)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void DiskKeeper::NoteFailure(const Status& failure) {
  if (failure.code() == StatusCode::kIoError) SetDue();
}

void DiskKeeper::Look() {
  const Status read =
      CatchShortage("look at the files", [this] { return engine_->Ask().Journal(1, 1).status(); });
  // One that opens them at this moment has opened them when this is tried.
  if (read.code() == StatusCode::kBusy) SetDue();
}

void DiskKeeper::SetDue() {
  const std::lock_guard lock(mutex_);
  is_due_ = true;
  changed_.notify_all();
}

void DiskKeeper::Stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void DiskKeeper::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return is_due_; })) {
    is_due_ = false;
    lock.unlock();
    const bool is_open = Reopen();
    if (is_open) reopened_();
    lock.lock();
    is_due_ = is_due_ || !is_open;
    changed_.wait_for(lock, stop, kPause, [] { return false; });
  }
}

bool DiskKeeper::Reopen() const {
  return HasRoom() &&
         CatchShortage("open the files again", [this] { return engine_->Reopen(); }).ok();
}

bool DiskKeeper::HasRoom() const {
  int file = open(path_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0) {  // some file systems have no files without a name
    std::string name = path_ + "/room-XXXXXX";
    file = mkostemp(name.data(), O_CLOEXEC);
    if (file < 0) return false;
    unlink(name.c_str());
  }
  const bool has_room = posix_fallocate(file, 0, kRoomBytes) == 0;
  close(file);
  return has_room;
}

}  // namespace veduta
