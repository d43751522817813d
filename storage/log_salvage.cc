// SPDX-License-Identifier: Apache-2.0
#include "storage/log_salvage.h"

#include <rocksdb/file_system.h>

#include <memory>

#include "storage/acknowledged.h"
#include "storage/database_opener.h"
#include "storage/durable_folder.h"
#include "storage/folder_lock.h"
#include "storage/log_reader.h"
#include "storage/log_writer.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// Keeps damaged logs as they are, and writes them anew.
class LogRewriter final {
 public:
  LogRewriter(rocksdb::FileSystem& file_system, std::string folder)
      : file_system_(file_system), folder_(std::move(folder)) {}

  // Afterwards every log is readable from its begin to its end, and nothing is claimed of it.
  Status Run(const LogDamage& damage) {
    VEDUTA_RETURN_IF_ERROR(MakeSetAside());
    for (const std::string& log : damage.unreadable_logs) VEDUTA_RETURN_IF_ERROR(Keep(log));
    const bool is_marked = Exists(InFolder(kAcknowledgedFile));
    if (is_marked) VEDUTA_RETURN_IF_ERROR(Keep(kAcknowledgedFile));
    VEDUTA_RETURN_IF_ERROR(MakeFolderDurable(file_system_, set_aside_));
    for (const std::string& log : damage.unreadable_logs) VEDUTA_RETURN_IF_ERROR(WriteAnew(log));
    return MakeFolderDurable(file_system_, folder_);
  }

 private:
  std::string InFolder(const std::string& name) const { return folder_ + "/" + name; }
  bool Exists(const std::string& path) const {
    return file_system_.FileExists(path, rocksdb::IOOptions(), nullptr).ok();
  }

  Status MakeFolder(const std::string& path) {
    return FromRocksdb(file_system_.CreateDirIfMissing(path, rocksdb::IOOptions(), nullptr),
                       "create folder " + path);
  }

  Status MakeSetAside() {
    const std::string all = InFolder(kSetAsideFolder);
    VEDUTA_RETURN_IF_ERROR(MakeFolder(all));
    for (int number = 1; set_aside_.empty() || Exists(set_aside_); ++number)
      set_aside_ = all + "/" + std::to_string(number);
    VEDUTA_RETURN_IF_ERROR(MakeFolder(set_aside_));
    VEDUTA_RETURN_IF_ERROR(MakeFolderDurable(file_system_, all));
    return MakeFolderDurable(file_system_, folder_);
  }

  Status Keep(const std::string& name) {
    const std::string kept = set_aside_ + "/" + name;
    std::string bytes;
    VEDUTA_RETURN_IF_ERROR(FromRocksdb(
        rocksdb::ReadFileToString(&file_system_, InFolder(name), &bytes), "read " + name));
    return FromRocksdb(rocksdb::WriteStringToFile(&file_system_, bytes, kept, /*should_sync=*/true),
                       "write " + kept);
  }

  Status WriteAnew(const std::string& log) {
    const std::string anew = InFolder(log + ".anew");
    VEDUTA_ASSIGN_OR_RETURN(LogWriter writer, LogWriter::Make(file_system_, anew));
    VEDUTA_RETURN_IF_ERROR(ReadLog(file_system_, InFolder(log), [&](const LogPiece& piece) {
      return piece.readable ? writer.Add(piece.record) : Status::Ok();
    }));
    VEDUTA_RETURN_IF_ERROR(writer.Finish());
    return FromRocksdb(file_system_.RenameFile(anew, InFolder(log), rocksdb::IOOptions(), nullptr),
                       "write " + InFolder(log));
  }

  rocksdb::FileSystem& file_system_;
  const std::string folder_;
  std::string set_aside_;
};

}  // namespace

Status SalvageLogs(const std::string& path, const DatabaseOptions& options) {
  DatabaseOptions writing = options;
  writing.create = writing.read_only = false;
  const std::shared_ptr<rocksdb::FileSystem> file_system =
      options.file_system ? options.file_system : rocksdb::FileSystem::Default();
  {
    VEDUTA_ASSIGN_OR_RETURN(const FolderLock lock, FolderLock::Take(path, options.file_system));
    VEDUTA_ASSIGN_OR_RETURN(const LogDamage damage, InspectLogs(path, writing));
    if (!damage.damaged()) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(LogRewriter(*file_system, path).Run(damage));
  }
  // RocksDB makes tables of what the logs hold, and the mark is made anew.
  DatabaseOpener opener(path, writing);
  opener.AcceptDamagedLog();
  return opener.Open().status();
}

}  // namespace veduta
