// SPDX-License-Identifier: Apache-2.0
#include "storage/log_inspection.h"

#include <rocksdb/db.h>
#include <rocksdb/file_system.h>

#include <algorithm>
#include <memory>

#include "storage/acknowledged.h"
#include "storage/log_names.h"
#include "storage/log_reader.h"
#include "storage/manifest_facts.h"
#include "storage/manifest_inspection.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// Where RocksDB's replay ends.
struct Stop {
  uint64_t log = 0;
  uint64_t begin_bytes = 0, end_bytes = 0;
  bool unreadable = false;        // otherwise a record does not follow on the one before
  bool may_be_unwritten = false;  // of what is unreadable
  bool is_inside = false;         // of a log: something readable follows in the same one
};

// Walks over the logs in their order, as RocksDB's recovery to a point in time does.
class LogWalk final {
 public:
  // `acknowledged` is the last sequence number that the mark claims, 0 without a mark; the first
  // record follows on `in_manifest`, or repeats what came before it.
  LogWalk(uint64_t acknowledged, uint64_t in_manifest)
      : acknowledged_(acknowledged), last_readable_(in_manifest) {}

  Status ReadNext(rocksdb::FileSystem& file_system, const std::string& folder, uint64_t log) {
    log_ = log;
    is_first_in_log_ = true;
    bool spoiled = false;
    VEDUTA_RETURN_IF_ERROR(ReadLog(file_system, folder + "/" + LogName(log), [&](const auto& p) {
      if (p.readable) {
        TakeRecord(p);
      } else {
        spoiled = true;
        TakeUnreadable(p);
      }
      return Status::Ok();
    }));
    if (spoiled) damage_.unreadable_logs.push_back(LogName(log));
    return Status::Ok();
  }

  // Counts what is missing between the last record and the mark.
  LogDamage Finish() {
    damage_.writes_missing += MissingUpTo(acknowledged_);
    return damage_;
  }

  const std::optional<Stop>& stop() const { return stop_; }
  uint64_t reached() const { return reached_; }  // 0 where nothing was replayed
  // Whether sequence numbers are missing between records.
  bool misses_writes() const { return misses_writes_; }

 private:
  void TakeUnreadable(const LogPiece& piece) {
    if (stop_) return;
    stop_ = Stop{.log = log_,
                 .begin_bytes = piece.begin_bytes,
                 .end_bytes = piece.end_bytes,
                 .unreadable = true,
                 .may_be_unwritten = piece.may_be_unwritten};
  }

  void TakeRecord(const LogPiece& piece) {
    const uint64_t last = piece.sequence + piece.count - 1;
    const bool follows =
        any_readable_ ? piece.sequence == last_readable_ + 1 : piece.sequence <= last_readable_ + 1;
    if (!follows) {
      misses_writes_ = true;
      damage_.writes_missing += MissingUpTo(piece.sequence - 1);
    }
    // What was before the first readable record is not known from numbers: the manifest may have
    // that of one family alone, which was flushed by itself.
    if (!any_readable_ && stop_) misses_writes_ = true;
    any_readable_ = true;
    last_readable_ = last;
    // RocksDB goes on in a later log that follows on what it has replayed.
    if (stop_ && stop_->log != log_ && reached_ != 0 && piece.sequence == reached_ + 1) {
      if (damage_.records_after == 0) stop_.reset();
    } else if (!stop_ && !follows) {
      stop_ = Stop{.log = log_,
                   .begin_bytes = piece.begin_bytes,
                   .end_bytes = piece.begin_bytes,
                   .is_inside = !is_first_in_log_};
    }
    is_first_in_log_ = false;
    if (!stop_) {
      ++damage_.records_before;
      reached_ = last;
      return;
    }
    ++damage_.records_after;
    if (stop_->log == log_ && stop_->unreadable) stop_->is_inside = true;
  }

  // Of the writes behind the last readable one, those up to `last` that were acknowledged.
  uint64_t MissingUpTo(uint64_t last) const {
    const uint64_t end = acknowledged_ == 0 ? last : std::min(last, acknowledged_);
    return end > last_readable_ ? end - last_readable_ : 0;
  }

  const uint64_t acknowledged_;
  LogDamage damage_;
  std::optional<Stop> stop_;
  uint64_t log_ = 0, reached_ = 0;
  bool is_first_in_log_ = true, any_readable_ = false, misses_writes_ = false;
  uint64_t last_readable_;
};

// Logs that the mark and the manifest want and that are not there.
std::vector<std::string> MissingLogs(const AcknowledgedMark& mark, const ManifestFacts& manifest,
                                     const std::vector<uint64_t>& logs) {
  std::vector<std::string> missing;
  const auto want = [&](uint64_t log) {
    if (std::find(logs.begin(), logs.end(), log) == logs.end()) missing.push_back(LogName(log));
  };
  if (manifest.first_log > std::max(mark.log, mark.first_log)) {
    // All that was acknowledged is in tables. The log that was begun since has any number.
    if (logs.empty()) missing.push_back(LogName(manifest.first_log));
    return missing;
  }
  // The manifest may name a number below that of the first log since the database was opened.
  const uint64_t first = std::max(manifest.first_log, mark.first_log);
  want(first);
  if (mark.log > first) want(mark.log);
  return missing;
}

std::string Count(uint64_t number, const std::string& noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

std::string Sentence(const std::string& path, const std::optional<Stop>& stop,
                     const LogDamage& damage) {
  std::string sentence = "the write-ahead log of the database at " + path + " is damaged: ";
  if (!damage.missing_logs.empty()) {
    sentence += "its file " + damage.missing_logs.front() + " is missing";
  } else if (!stop) {
    sentence += "its end is missing";
  } else if (stop->unreadable) {
    sentence += "its file " + LogName(stop->log) + " cannot be read from byte " +
                std::to_string(stop->begin_bytes) + " to byte " + std::to_string(stop->end_bytes);
  } else {
    sentence += "in its file " + LogName(stop->log) + " something is missing before byte " +
                std::to_string(stop->begin_bytes);
  }
  sentence += "; " + Count(damage.records_after, "record") + " behind that can still be read";
  if (damage.writes_missing > 0)
    sentence += ", and " + Count(damage.writes_missing, "write") + " cannot";
  return sentence;
}

// A power cut or a write that failed has left this, as far as anybody can tell. What was
// acknowledged is there. Where a write fails halfway, RocksDB may write the same record once more
// when it closes the log: then nothing is missing between the records.
bool IsForgiven(const Stop& stop, bool has_mark, uint64_t records_after, bool misses_writes) {
  if (records_after == 0 || !misses_writes) return true;
  if (stop.unreadable && stop.may_be_unwritten) return true;
  return !stop.is_inside && has_mark;
}

// RocksDB replays nothing from the stop on.
std::vector<LogDamage::CutLog> EndFrom(const Stop& stop, const std::vector<uint64_t>& logs) {
  std::vector<LogDamage::CutLog> end;
  for (const uint64_t log : logs) {
    if (log >= stop.log) end.push_back({LogName(log), log == stop.log ? stop.begin_bytes : 0});
  }
  return end;
}

Status CutLogTo(rocksdb::FileSystem& file_system, const std::string& path, uint64_t size_bytes) {
  const std::string doing = "cut the end off " + path;
  uint64_t now = 0;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(file_system.GetFileSize(path, rocksdb::IOOptions(), &now, nullptr), doing));
  if (now <= size_bytes) return Status::Ok();
  std::unique_ptr<rocksdb::FSWritableFile> file;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(
      file_system.ReopenWritableFile(path, rocksdb::FileOptions(), &file, nullptr), doing));
  rocksdb::IOStatus status = file->Truncate(size_bytes, rocksdb::IOOptions(), nullptr);
  if (status.ok()) status = file->Fsync(rocksdb::IOOptions(), nullptr);
  const rocksdb::IOStatus closed = file->Close(rocksdb::IOOptions(), nullptr);
  return FromRocksdb(status.ok() ? closed : status, doing);
}

}  // namespace

Result<LogDamage> InspectLogs(const std::string& path, const DatabaseOptions& options) {
  const std::shared_ptr<rocksdb::FileSystem> file_system =
      options.file_system ? options.file_system : rocksdb::FileSystem::Default();
  // In this order: beside a writer, what is read later is newer, and promises more.
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<AcknowledgedMark> mark,
                          ReadAcknowledged(*file_system, path));
  VEDUTA_RETURN_IF_ERROR(CheckManifest(path, *file_system, mark));
  VEDUTA_ASSIGN_OR_RETURN(const ManifestFacts manifest, ReadManifestFacts(path, file_system));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<uint64_t> logs, ListLogs(*file_system, path));
  std::erase_if(logs, [&](uint64_t log) { return log < manifest.first_log; });
  LogWalk walk(mark ? mark->sequence : 0, manifest.last_sequence);
  for (const uint64_t log : logs) VEDUTA_RETURN_IF_ERROR(walk.ReadNext(*file_system, path, log));

  const bool in_tables = !mark || manifest.first_log > mark->log;
  const uint64_t in_manifest = in_tables ? manifest.last_sequence : 0;
  const uint64_t reached = std::max(walk.reached(), in_manifest);
  LogDamage damage = walk.Finish();
  if (!logs.empty()) damage.last_log = logs.back();
  if (mark) damage.missing_logs = MissingLogs(*mark, manifest, logs);
  const std::optional<Stop>& stop = walk.stop();
  const bool forgiven =
      !stop || IsForgiven(*stop, mark.has_value(), damage.records_after, walk.misses_writes());
  if ((mark && reached < mark->sequence) || !damage.missing_logs.empty() || !forgiven) {
    damage.sentence = Sentence(path, stop, damage);
  } else if (stop) {
    if (damage.records_after > 0) damage.last_replayed_sequence = walk.reached();
    damage.forgiven_end = EndFrom(*stop, logs);
  }
  return damage;
}

// From the last log to the first: what is left in between is the same end, and shorter.
Status CutForgivenEnd(rocksdb::FileSystem& file_system, const std::string& path,
                      const LogDamage& damage) {
  for (auto log = damage.forgiven_end.rbegin(); log != damage.forgiven_end.rend(); ++log)
    VEDUTA_RETURN_IF_ERROR(CutLogTo(file_system, path + "/" + log->name, log->size_bytes));
  return Status::Ok();
}

Status DamagedLogStatus(const std::string& path, const LogDamage& damage) {
  return Status::Corruption(damage.sentence + ". Nothing was changed: 'veduta repair " + path +
                            "' keeps a copy of the log and brings back what can be read");
}

}  // namespace veduta
