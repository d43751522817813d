// SPDX-License-Identifier: Apache-2.0
#pragma once
// The journal, and then what happens, for one who follows the city.

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "cli/rpc/caller.h"
#include "cli/rpc/veduta.capnp.h"

namespace veduta {

// Entries of the journal in one message, at most. Chosen by hand.
inline constexpr uint32_t kEntriesMax = 256;

struct JournalPage {
  std::vector<JournalAnswer> entries;
  uint64_t snapshot = 0;
};
Result<JournalPage> ReadJournal(const Engine& engine, const Sight& sight, uint64_t first,
                                uint32_t count);

class JournalFollower final {
 public:
  // Throws where the caller may not follow, which counts in the token's quota this once, and 429
  // where the session has too many.
  JournalFollower(Caller caller, rpc::Watcher::Client watcher);

  // Tells the watcher from the entry `first` on, until it fails: with 401 where the token is not
  // good any more. To be dropped before this is.
  kj::Promise<void> Tell(uint64_t first);

 private:
  kj::Promise<void> TellLater(uint64_t first);
  kj::Promise<void> TellPage(const JournalPage& page);

  const Caller caller_;
  HttpRequest asked_;  // that was let in; what may be told is looked up anew
  const std::shared_ptr<BudgetShare> place_;
  rpc::Watcher::Client watcher_;
};

}  // namespace veduta
