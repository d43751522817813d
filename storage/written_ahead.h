// SPDX-License-Identifier: Apache-2.0
#pragma once
// Gives up what was written ahead when its commit has not come: a photo that is cancelled, a
// vocabulary whose preparation failed. So a process that runs for long keeps nothing that no record
// names, and needs no opening to sweep it.

#include <functional>
#include <utility>

#include "storage/database.h"

namespace veduta {

// Held by whoever wrote ahead, until the commit has come or will not come any more. Its end calls
// the Drop function of Database, which deletes nothing that a commit has named. Where the deletion
// fails, the next opening sweeps. The database must outlive it. Movable; not thread-safe.
class WrittenAhead final {
 public:
  WrittenAhead() = default;  // of nothing
  static WrittenAhead Photo(Database* database, const ContentHash& photo) {
    return WrittenAhead([=] { return database->DropPhotoAhead(photo); });
  }
  static WrittenAhead PointBlocks(Database* database, ReconstructionId reconstruction,
                                  uint32_t generation) {
    return WrittenAhead([=] { return database->DropPointBlocksAhead(reconstruction, generation); });
  }
  static WrittenAhead Vocabulary(Database* database, uint32_t generation) {
    return WrittenAhead([=] { return database->DropVocabularyAhead(generation); });
  }

  WrittenAhead(WrittenAhead&& other) noexcept : drop_(std::exchange(other.drop_, nullptr)) {}
  WrittenAhead& operator=(WrittenAhead&& other) noexcept {
    if (this != &other) {
      Drop();
      drop_ = std::exchange(other.drop_, nullptr);
    }
    return *this;
  }
  ~WrittenAhead() { Drop(); }

 private:
  explicit WrittenAhead(std::function<Status()> drop) : drop_(std::move(drop)) {}

  // Called while an exception is on its way, too: whatever is thrown here would end the program.
  void Drop() noexcept {
    try {
      if (drop_) drop_().IgnoreBecause("the next opening sweeps what is left of it");
    } catch (...) {  // memory is short: the next opening sweeps it
    }
    drop_ = nullptr;
  }

  std::function<Status()> drop_;
};

}  // namespace veduta
