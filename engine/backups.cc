// SPDX-License-Identifier: Apache-2.0
// Backups: Engine::Backup, and what is done with the folder that keeps them.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "engine/engine.h"
#include "engine/parts.h"
#include "storage/backup_folder.h"
#include "storage/base/system_status.h"
#include "storage/file_copy.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

BackupAnswer AnswerOf(const BackupManifest& backup) {
  return {backup.number, backup.time_unix_s, backup.database, backup.files.size(),
          backup.SizeBytes()};
}

Status Remove(const std::string& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  return FromSystem(error, "delete " + folder);
}

// Opens and closes the database that the files make: the manifest, the logs and the tables fit.
Status TryToOpen(const std::string& folder, DatabaseOptions options = {}) {
  options.create = false;
  options.read_only = true;
  return Database::Open(folder, options).status();
}

// A name beside the database that is to be restored, and a lock on it. It goes at the end.
class RestoringFolder final {
 public:
  static Result<std::unique_ptr<RestoringFolder>> Make(const std::string& path) {
    std::unique_ptr<RestoringFolder> made(new RestoringFolder(path));
    std::error_code error;
    fs::create_directory(path, error);
    VEDUTA_RETURN_IF_ERROR(FromSystem(error, "make folder " + path));
    made->file_ = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (made->file_ < 0) return Status::IoError("cannot open " + path);
    if (flock(made->file_, LOCK_EX | LOCK_NB) != 0)
      return Status::Busy("another program restores to the same place, by way of " + path);
    made->is_own_ = true;
    // What a restore that was killed has left.
    for (fs::directory_iterator entry(path, error), end; !error && entry != end;
         entry.increment(error))
      fs::remove_all(entry->path(), error);
    VEDUTA_RETURN_IF_ERROR(FromSystem(error, "empty folder " + path));
    return made;
  }
  ~RestoringFolder() {
    if (is_own_) Remove(path_).IgnoreBecause("the next restore to this place deletes it");
    if (file_ >= 0) close(file_);
  }
  RestoringFolder(const RestoringFolder&) = delete;
  RestoringFolder& operator=(const RestoringFolder&) = delete;

  // Gives the folder its name, unless somebody has it by now.
  Status Rename(const std::string& path) {
    if (renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) != 0) {
      const std::error_code error(errno, std::generic_category());
      if (error == std::errc::file_exists) return Status::AlreadyExists(path + " exists already");
      return FromSystem(error, "rename " + path_ + " to " + path);
    }
    is_own_ = false;
    return SyncFolder(fs::path(path).parent_path().string());
  }

 private:
  explicit RestoringFolder(std::string path) : path_(std::move(path)) {}
  const std::string path_;
  int file_ = -1;
  bool is_own_ = false;
};

// Without "." and "..", and without a slash at the end.
std::string PlainPath(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path);
  const fs::path canonical = fs::weakly_canonical(absolute, error);
  const fs::path plain = error ? absolute.lexically_normal() : canonical;
  return (plain.has_filename() ? plain : plain.parent_path()).string();
}

Status CheckIsOutside(const std::string& folder, const std::string& database) {
  if (!(PlainPath(folder) + "/").starts_with(PlainPath(database) + "/")) return Status::Ok();
  return Status::InvalidArgument(PlainPath(folder) +
                                 " is inside of the database: name another folder");
}

}  // namespace

Status BackupRequest::Check() const {
  return folder.empty() ? Status::InvalidArgument("the folder of backups has no name")
                        : Status::Ok();
}

// The copy is in the journal before others may remove a photo that it has.
Status Engine::Copy(const std::string& folder, std::stop_token stop) {
  const std::shared_ptr<EngineParts> parts = parts_;
  VEDUTA_RETURN_IF_ERROR(CheckIsOutside(folder, parts->path));
  {
    Writer::Turn turn = parts->writer->Take();
    if (stop.stop_requested()) return Status::Cancelled("stopped before the copy was made");
    VEDUTA_RETURN_IF_ERROR(turn.database().CreateCheckpoint(folder));
    VEDUTA_RETURN_IF_ERROR(parts->NoteCopy(kCopyMade, folder, &turn));
  }
  Status checked = parts->database->CheckCheckpoint(folder, stop);
  if (checked.ok()) return checked;
  Writer::Turn turn = parts->writer->Take();
  parts->NoteCopy(kCopyDeleted, folder, &turn)
      .IgnoreBecause("why there is none is told; a removal then names a copy that is gone");
  return checked;
}

Result<BackupReport> Engine::Backup(const BackupRequest& request, std::stop_token stop) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  const std::shared_ptr<EngineParts> parts = parts_;
  const std::string database = PlainPath(parts->path), folder = PlainPath(request.folder);
  VEDUTA_RETURN_IF_ERROR(CheckIsOutside(folder, parts->path));
  const std::optional<Claimable::Claim> alone = parts->backing_up.TryClaim();
  if (!alone) return Status::Busy("a backup is being made: try again when it has ended");
  VEDUTA_ASSIGN_OR_RETURN(BackupFolder backups,
                          BackupFolder::Open(folder, BackupFolder::Use::kChange, /*create=*/true));
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> older, backups.List(&damage));
  // Links in the database's own folder, which any file system has that holds a database.
  const std::string links = database + "/" + kBackupLinks;
  VEDUTA_RETURN_IF_ERROR(parts->DropBackupLinks());
  {
    Writer::Turn turn = parts->writer->Take();
    VEDUTA_RETURN_IF_ERROR(turn.database().CreateCheckpoint(links));
    VEDUTA_RETURN_IF_ERROR(parts->NoteCopy(kCopyMade, folder, &turn));
  }
  Status done = TryToOpen(links, parts->tuning.database);
  BackupReport report;
  if (done.ok()) {
    auto added = backups.Add(links, database, stop);
    done = added.status();
    if (added.ok()) report = {AnswerOf(added->backup), added->copied_files, added->copied_bytes, 0};
  }
  const Status dropped = parts->DropBackupLinks();
  if (!done.ok()) {
    // One that was stopped goes on from the files that it has copied.
    if (done.code() == StatusCode::kCancelled) return done;
    const bool is_empty = backups.DropUnused().ok() && older.empty() && damage.sentences.empty();
    if (is_empty) {
      Writer::Turn turn = parts->writer->Take();
      parts->NoteCopy(kCopyDeleted, folder, &turn)
          .IgnoreBecause("a removal then names a copy that is gone");
    }
    return Status(done.code(),
                  "no backup was made, and older ones are as they were: " + done.message());
  }
  if (request.keep > 0) {
    VEDUTA_ASSIGN_OR_RETURN(report.deleted, backups.Thin(request.keep));
  }
  VEDUTA_RETURN_IF_ERROR(backups.DropUnused());
  VEDUTA_RETURN_IF_ERROR(dropped);
  return report;
}

Status EngineParts::DropBackupLinks() const {
  // RocksDB makes links under the first name, and renames the folder.
  VEDUTA_RETURN_IF_ERROR(Remove(path + "/" + kBackupLinks + ".tmp"));
  return Remove(path + "/" + kBackupLinks);
}

Result<BackupList> ListBackups(const std::string& folder) {
  VEDUTA_ASSIGN_OR_RETURN(const BackupFolder backups,
                          BackupFolder::Open(folder, BackupFolder::Use::kLook));
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> found, backups.List(&damage));
  BackupList list{{}, damage.sentences};
  for (const BackupManifest& backup : found) list.backups.push_back(AnswerOf(backup));
  return list;
}

Result<BackupList> CheckBackups(const std::string& folder, std::stop_token stop) {
  VEDUTA_ASSIGN_OR_RETURN(const BackupFolder backups,
                          BackupFolder::Open(folder, BackupFolder::Use::kRead));
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> found, backups.List(&damage));
  BackupList list{{}, damage.sentences};
  for (const BackupManifest& backup : found) list.backups.push_back(AnswerOf(backup));
  VEDUTA_ASSIGN_OR_RETURN(const BackupDamage damaged, backups.Check(found, stop));
  list.damage.insert(list.damage.end(), damaged.sentences.begin(), damaged.sentences.end());
  return list;
}

Result<uint32_t> ThinBackups(const std::string& folder, uint32_t keep) {
  if (keep == 0) return Status::InvalidArgument("keep is 0, but must be at least 1");
  VEDUTA_ASSIGN_OR_RETURN(BackupFolder backups,
                          BackupFolder::Open(folder, BackupFolder::Use::kChange));
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t deleted, backups.Thin(keep));
  VEDUTA_RETURN_IF_ERROR(backups.DropUnused());
  return deleted;
}

Result<BackupAnswer> RestoreBackup(const std::string& folder, uint32_t number,
                                   const std::string& path, std::stop_token stop) {
  VEDUTA_ASSIGN_OR_RETURN(const BackupFolder backups,
                          BackupFolder::Open(folder, BackupFolder::Use::kRead));
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> found, backups.List(&damage));
  const auto backup = std::find_if(found.rbegin(), found.rend(), [&](const BackupManifest& one) {
    return number == 0 || one.number == number;
  });
  const std::string wanted = number == 0 ? "no backup" : "no backup " + std::to_string(number);
  if (!damage.sentences.empty() && (backup == found.rend() || number == 0))
    return Status::Corruption(damage.sentences.back() +
                              ": `veduta backups list` shows the others, and --backup names one");
  if (backup == found.rend()) return Status::NotFound("there is " + wanted + " in " + folder);
  const std::string target = PlainPath(path);
  std::error_code error;
  if (fs::exists(fs::symlink_status(target, error)))
    return Status::AlreadyExists(target + " exists already: name a folder that does not");
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<RestoringFolder> restoring,
                          RestoringFolder::Make(target + ".restoring"));
  VEDUTA_RETURN_IF_ERROR(backups.CopyOut(*backup, target + ".restoring", stop));
  VEDUTA_RETURN_IF_ERROR(TryToOpen(target + ".restoring"));
  VEDUTA_RETURN_IF_ERROR(restoring->Rename(target));
  return AnswerOf(*backup);
}

}  // namespace veduta
