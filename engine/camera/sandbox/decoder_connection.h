// SPDX-License-Identifier: Apache-2.0
#pragma once
// One decoder process (process/decoder_process.h), as the program that uses it sees it.

#include <sys/types.h>

#include <memory>
#include <optional>
#include <utility>

#include "engine/camera/sandbox/exchange.h"
#include "engine/camera/sandbox/shared_memory.h"
#include "storage/base/status.h"

namespace veduta {

// Used by one thread at a time. It ends the process at its end.
class DecoderConnection final {
 public:
  // Starts the program that the descriptor is open for, without environment, as nice as the calling
  // thread, and waits until it has shown that its children are shut in. kIoError says what is
  // missing.
  static Result<std::unique_ptr<DecoderConnection>> Start(int program);
  ~DecoderConnection();
  DecoderConnection(const DecoderConnection&) = delete;
  DecoderConnection& operator=(const DecoderConnection&) = delete;

  // Has a child do what is asked, and returns when it has ended; nothing where the process itself
  // has ended or does not answer. Then nothing can be asked of it any more.
  std::optional<DecoderEnd> Ask(const DecoderRequest& request, int photo, int answer);
  int niceness() const { return niceness_; }

 private:
  DecoderConnection(pid_t process, Descriptor control, int niceness)
      : process_(process), control_(std::move(control)), niceness_(niceness) {}

  const pid_t process_;
  const Descriptor control_;
  const int niceness_;
};

// Of the calling thread.
int NicenessOfThread();

}  // namespace veduta
