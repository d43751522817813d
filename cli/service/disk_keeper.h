// SPDX-License-Identifier: Apache-2.0
#pragma once
// Opens the engine's files again after a write has failed, once the disk has room.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "engine/engine.h"

namespace veduta {

// After a failed write the engine refuses all others until its files are opened again; and where
// opening fails, nothing can be asked any more. So it is tried until it works, by a thread of its
// own, whether somebody asks for something meanwhile or not. Thread-safe. Must be stopped before
// the engine ends.
class DiskKeeper final {
 public:
  // `path` is the database's folder. `reopened` is called after each opening, by the thread; it
  // must not throw.
  DiskKeeper(Engine* engine, std::string path, std::function<void()> reopened);

  // To be told of what may have been a failed write: kIoError; all else is no reason. Returns at
  // once.
  void NoteFailure(const Status& failure);
  // To be called now and then: tries it, too, where the files are found closed, as after a removal
  // that could not open them again. Returns soon.
  void Look();
  // Nothing is tried from now on; an attempt that runs has ended when it returns.
  void Stop();

 private:
  void SetDue();
  void Run(const std::stop_token& stop);
  // Whether the files have been opened again. They are not touched where the disk has no room: they
  // can still be read then.
  bool Reopen() const;
  bool HasRoom() const;

  Engine* const engine_;
  const std::string path_;
  const std::function<void()> reopened_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_due_ = false;
  std::jthread thread_;
};

}  // namespace veduta
