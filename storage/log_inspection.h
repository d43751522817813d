// SPDX-License-Identifier: Apache-2.0
#pragma once
// Is the write-ahead log whole? RocksDB takes the first damaged byte of its log for the log's end,
// forgets what follows and deletes the file. So the log is read here first, and nothing is changed.
//
// These are forgiven, because a power cut leaves them: an end that is torn, also where a later log
// follows it, and zeros in place of pages or sectors in an end that was never synced. Damage is
// everything else:
//   - the log ends before what was acknowledged (storage/acknowledged.h),
//   - a log is missing that should be there,
//   - something unreadable is followed by what can be read.
// Where the database has no file ACKNOWLEDGED, only the last of them is noticed.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/database_options.h"

namespace rocksdb {
class FileSystem;
}

namespace veduta {

struct LogDamage {
  // Empty where the log is whole. Otherwise one sentence for people, which names the file and the
  // byte and says what is missing, without saying what to do.
  std::string sentence;

  std::vector<std::string> unreadable_logs;  // names in the folder, of those with unreadable parts
  std::vector<std::string> missing_logs;
  // A record is what one write to the database added: a commit, or something written ahead. It
  // holds many writes of a key and value each.
  uint64_t records_before = 0;  // that can be read before the first damage
  uint64_t records_after = 0;   // that can be read behind it
  uint64_t writes_missing = 0;  // that were acknowledged, and that nothing readable holds
  // What RocksDB may replay of the logs up to last_log, the newest that was read: where an end that
  // was never synced has a hole, no write behind it.
  std::optional<uint64_t> last_replayed_sequence;
  uint64_t last_log = 0;
  // The end that is forgiven: of each log, in their order, the length of what counts. Empty where
  // the log is damaged, or whole.
  struct CutLog {
    std::string name;
    uint64_t size_bytes = 0;
  };
  std::vector<CutLog> forgiven_end;

  bool damaged() const { return !sentence.empty(); }
};

// Reads the whole log: 0.25 s for 256 MiB in memory. A process that writes beside this may delete a
// log meanwhile, which looks like damage: where the names in the folder have changed, look again.
// kNotFound where there is no database, kIoError, and what RocksDB says where its other files are
// damaged.
Result<LogDamage> InspectLogs(const std::string& path, const DatabaseOptions& options);

// Cuts off the end that is forgiven, durably. Before anything is written to a new log: RocksDB
// keeps a log of which it could read nothing, and at the next opening it would stop there, and
// forget what was acknowledged since. For the holder of the database's lock; may be called again.
// kIoError.
Status CutForgivenEnd(rocksdb::FileSystem& file_system, const std::string& path,
                      const LogDamage& damage);

// What to tell whoever opens the database: kCorruption with the sentence, and what to do.
Status DamagedLogStatus(const std::string& path, const LogDamage& damage);

}  // namespace veduta
