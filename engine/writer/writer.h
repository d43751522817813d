// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one way to write to a database: whoever wants to write waits for a turn.

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

#include "storage/database.h"

namespace veduta {

// Thread-safe. Turns are given in the order in which they were asked for, so nobody who writes
// again and again keeps another waiting. Work that takes long is done without a turn, from a
// snapshot; a turn is for one bounded piece: begin a transaction, then take a snapshot, see that
// what the piece was made from still holds, write, commit.
class Writer final {
 public:
  // The database must outlive the writer, and the writer every turn.
  explicit Writer(Database* database) : database_(database) {}
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // The right to write, until it is destroyed. The thread that holds one must not take another:
  // it would wait for itself.
  class Turn {
   public:
    Turn(Turn&& other) noexcept : writer_(other.writer_) { other.writer_ = nullptr; }
    Turn& operator=(Turn&&) = delete;
    ~Turn();

    Database& database() { return *writer_->database_; }

   private:
    friend class Writer;
    explicit Turn(Writer* writer) : writer_(writer) {}
    Writer* writer_;  // null: moved from
  };

  // Blocks until all turns that were asked for before have ended.
  Turn Take();

  // Reading needs no turn.
  std::shared_ptr<const Snapshot> GetSnapshot() const { return database_->GetSnapshot(); }

 private:
  Database* const database_;
  std::mutex mutex_;
  std::condition_variable turn_ended_;
  uint64_t next_number_ = 0;  // of the turn that is asked for next
  uint64_t served_ = 0;       // the number whose turn it is
};

}  // namespace veduta
