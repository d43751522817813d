// SPDX-License-Identifier: Apache-2.0
#include "storage/backup_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <limits>
#include <map>

#include "storage/base/plain_text.h"
#include "storage/base/system_status.h"
#include "storage/base/whole_file.h"
#include "storage/file_copy.h"
#include "storage/table_check.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

constexpr const char *kMarker = "VEDUTA-BACKUPS", *kMarkerText = "veduta backups 1\n";
constexpr const char *kFiles = "/files", *kBackups = "/backups", *kIncoming = "/files/incoming";
// A line of a manifest has some 150 bytes: enough for 400,000 files, or 100 TB.
constexpr size_t kManifestBytesMax = 64 << 20;

Status LastError(const std::string& doing) {
  return FromSystem(std::error_code(errno, std::generic_category()), doing);
}

Status MakeFolder(const std::string& path) {
  if (mkdir(path.c_str(), S_IRWXU) == 0 || errno == EEXIST) return Status::Ok();
  return LastError("make folder " + path);
}

// The names in the folder, ascending.
Result<std::vector<std::string>> NamesIn(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> names;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    names.push_back(entry->path().filename().string());
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "list folder " + folder));
  std::sort(names.begin(), names.end());
  return names;
}

// Whether a new folder of backups may be begun there.
Status MakeEmpty(const std::string& path) {
  VEDUTA_RETURN_IF_ERROR(MakeFolder(path));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, NamesIn(path));
  if (names.empty() || names == std::vector<std::string>{kMarker}) return Status::Ok();
  return Status::InvalidArgument(path + " is not empty, and no folder of backups: name another");
}

// The number that a manifest's name tells; 0 where it is none.
uint32_t NumberOf(const std::string& name) {
  uint32_t number = 0;
  const auto [rest, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  return error == std::errc() && std::to_string(number) == name ? number : 0;
}

// What to know a file of the database by.
Result<BackedUpFile> Look(const std::string& path, const std::string& name) {
  struct stat facts {};
  if (lstat(path.c_str(), &facts) != 0) return LastError("look at " + path);
  BackedUpFile file;
  file.name = name;
  file.size_bytes = static_cast<uint64_t>(facts.st_size);
  file.inode = facts.st_ino;
  file.modified_ns = facts.st_mtim.tv_sec * 1'000'000'000ll + facts.st_mtim.tv_nsec;
  return file;
}

bool IsTheSame(const BackedUpFile& a, const BackedUpFile& b) {
  return a.size_bytes == b.size_bytes && a.inode == b.inode && a.modified_ns == b.modified_ns;
}

}  // namespace

// Held as long as the folder is worked in.
struct BackupFolder::Lock {
  explicit Lock(int opened) : file(opened) {}
  ~Lock() { close(file); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;
  const int file;
};

BackupFolder::BackupFolder(std::string path, std::shared_ptr<Lock> lock)
    : path_(std::move(path)), lock_(std::move(lock)) {}

Result<BackupFolder> BackupFolder::Open(const std::string& path, Use use, bool create) {
  const std::string marker = path + "/" + kMarker;
  std::error_code missing;
  if (create && !fs::exists(marker, missing)) VEDUTA_RETURN_IF_ERROR(MakeEmpty(path));
  const int flags = use == Use::kLook ? O_RDONLY : O_RDWR | (create ? O_CREAT : 0);
  const int file = open(marker.c_str(), flags | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0 && errno != ENOENT && errno != ENOTDIR) return LastError("open " + marker);
  if (file < 0) return Status::NotFound("there is no folder of backups at " + path);
  const auto lock = std::make_shared<Lock>(file);
  if (use != Use::kLook) {
    const int how = use == Use::kChange ? LOCK_EX : LOCK_SH;
    if (flock(file, how | LOCK_NB) != 0)
      return Status::Busy("another program works with the backups in " + path);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(marker, 1024));
  // Whoever began the folder may have been killed before it was begun.
  if (create && text != kMarkerText && std::string_view(kMarkerText).starts_with(text)) {
    if (pwrite(file, kMarkerText, std::string_view(kMarkerText).size(), 0) < 0 || fsync(file) != 0)
      return LastError("write " + marker);
  } else if (text != kMarkerText) {
    return Status::InvalidArgument(marker + " is of another version of the program");
  }
  if (create) {
    VEDUTA_RETURN_IF_ERROR(MakeFolder(path + kFiles));
    VEDUTA_RETURN_IF_ERROR(MakeFolder(path + kBackups));
    VEDUTA_RETURN_IF_ERROR(SyncFolder(path));
  }
  return BackupFolder(path, lock);
}

Result<std::vector<BackupManifest>> BackupFolder::List(BackupDamage* damage) const {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, NamesIn(path_ + kBackups));
  std::vector<BackupManifest> backups;
  for (const std::string& name : names) {
    const uint32_t number = NumberOf(name);
    if (number == 0) continue;
    const std::string path = path_ + kBackups + "/" + name;
    const Result<std::string> text = ReadWholeFile(path, kManifestBytesMax);
    if (text.status().code() == StatusCode::kIoError && !fs::exists(path)) continue;  // thinned out
    Result<BackupManifest> manifest = text.ok() ? ParseManifest(*text) : text.status();
    if (manifest.ok() && manifest->number != number)
      manifest = Status::Corruption("it is of another backup");
    if (manifest.ok()) {
      backups.push_back(*std::move(manifest));
    } else {
      damage->sentences.push_back("backup " + name + " cannot be restored, for " + path +
                                  " is damaged: " + manifest.status().message());
    }
  }
  std::sort(backups.begin(), backups.end(),
            [](const BackupManifest& a, const BackupManifest& b) { return a.number < b.number; });
  return backups;
}

std::string BackupFolder::FilePath(const ContentHash& hash) const {
  return path_ + kFiles + "/" + hash.Hex();
}

bool BackupFolder::HasFile(const BackedUpFile& file) const {
  std::error_code error;
  return fs::file_size(FilePath(file.hash), error) == file.size_bytes && !error;
}

Status BackupFolder::CopyIn(const std::string& from, const BackedUpFile& file,
                            const std::stop_token& stop) const {
  const std::string incoming = path_ + kIncoming;
  VEDUTA_ASSIGN_OR_RETURN(const ContentHash copied, CopyFile(from, incoming, stop));
  if (copied != file.hash)
    return Status::Corruption(from + " reads differently each time: the disk or the memory fails");
  const std::string path = FilePath(file.hash);
  return rename(incoming.c_str(), path.c_str()) == 0 ? Status::Ok() : LastError("write " + path);
}

Result<BackupFolder::Added> BackupFolder::Add(const std::string& source,
                                              const std::string& database,
                                              const std::stop_token& stop) {
  if (!IsPlainText(database, /*may_have_lines=*/false))
    return Status::InvalidArgument("the path of the database has characters that are no text");
  BackupDamage damage;  // an older backup that is damaged keeps its number
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> older, List(&damage));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> numbers, NamesIn(path_ + kBackups));
  Added added;
  for (const std::string& name : numbers)
    added.backup.number = std::max(added.backup.number, NumberOf(name));
  if (added.backup.number == std::numeric_limits<uint32_t>::max())
    return Status::InvalidArgument("there are no more numbers for backups in " + path_);
  ++added.backup.number;
  added.backup.time_unix_s = std::time(nullptr);
  added.backup.database = database;
  std::map<std::string, BackedUpFile> seen;
  if (!older.empty()) {
    if (older.back().database != database)
      return Status::InvalidArgument(path_ + " has backups of " + older.back().database +
                                     ": name another folder");
    for (const BackedUpFile& file : older.back().files) seen.emplace(file.name, file);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, NamesIn(source));
  for (const std::string& name : names) {
    const std::string path = source + "/" + name;
    VEDUTA_ASSIGN_OR_RETURN(BackedUpFile file, Look(path, name));
    const auto before = seen.find(name);
    if (before != seen.end() && IsTheSame(before->second, file) && HasFile(before->second)) {
      file.hash = before->second.hash;
    } else {
      VEDUTA_RETURN_IF_ERROR(CheckStoredFile(path, stop));
      VEDUTA_ASSIGN_OR_RETURN(file.hash, HashFile(path, stop));
      if (!HasFile(file)) {
        VEDUTA_RETURN_IF_ERROR(CopyIn(path, file, stop));
        ++added.copied_files;
        added.copied_bytes += file.size_bytes;
      }
    }
    added.backup.files.push_back(std::move(file));
  }
  VEDUTA_RETURN_IF_ERROR(SyncFolder(path_ + kFiles));
  const std::string text = ManifestText(added.backup);
  VEDUTA_RETURN_IF_ERROR(ParseManifest(text).status());  // what could not be restored is no backup
  VEDUTA_RETURN_IF_ERROR(
      WriteFileWhole(path_ + kBackups + "/" + std::to_string(added.backup.number), text));
  return added;
}

Result<uint32_t> BackupFolder::Thin(uint32_t keep) {
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> backups, List(&damage));
  uint32_t thinned = 0;
  for (; backups.size() - thinned > keep; ++thinned) {
    const std::string path = path_ + kBackups + "/" + std::to_string(backups[thinned].number);
    if (unlink(path.c_str()) != 0) return LastError("delete " + path);
  }
  if (thinned > 0) VEDUTA_RETURN_IF_ERROR(SyncFolder(path_ + kBackups));
  return thinned;
}

Status BackupFolder::DropUnused() {
  BackupDamage damage;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<BackupManifest> backups, List(&damage));
  if (!damage.sentences.empty()) return Status::Ok();
  std::set<std::string> used;
  for (const BackupManifest& backup : backups) {
    for (const BackedUpFile& file : backup.files) used.insert(file.hash.Hex());
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, NamesIn(path_ + kFiles));
  for (const std::string& name : names) {
    const std::string path = path_ + kFiles + "/" + name;
    if (!used.contains(name) && unlink(path.c_str()) != 0) return LastError("delete " + path);
  }
  return Status::Ok();
}

Result<BackupDamage> BackupFolder::Check(const std::vector<BackupManifest>& backups,
                                         const std::stop_token& stop) const {
  struct Wanted {
    BackedUpFile file;
    std::string by;  // the numbers of the backups
  };
  std::map<ContentHash, Wanted> all;
  for (const BackupManifest& backup : backups) {
    for (const BackedUpFile& file : backup.files) {
      Wanted& wanted = all[file.hash];
      wanted.file = file;
      const std::string number = std::to_string(backup.number);
      if (wanted.by != number && !wanted.by.ends_with(" " + number))
        wanted.by += (wanted.by.empty() ? "" : ", ") + number;
    }
  }
  BackupDamage damage;
  for (const auto& [hash, wanted] : all) {
    const std::string path = FilePath(hash);
    const Result<ContentHash> found = HashFile(path, stop);
    if (found.status().code() == StatusCode::kCancelled) return found.status();
    if (found.ok() && *found == hash) continue;
    damage.sentences.push_back(
        path + " (" + wanted.file.name + ") " +
        (found.ok() ? "has other bytes than were written" : "is missing, or cannot be read") +
        ": of backup " + wanted.by);
  }
  return damage;
}

Status BackupFolder::CopyOut(const BackupManifest& backup, const std::string& target,
                             const std::stop_token& stop) const {
  for (const BackedUpFile& file : backup.files) {
    const std::string from = FilePath(file.hash);
    const std::string of = " (" + file.name + ", of backup " + std::to_string(backup.number) + ")";
    std::error_code error;
    if (!fs::exists(from, error)) return Status::Corruption(from + of + " is missing");
    VEDUTA_ASSIGN_OR_RETURN(const ContentHash copied,
                            CopyFile(from, target + "/" + file.name, stop));
    if (copied != file.hash)
      return Status::Corruption(from + of + " is damaged: it has other bytes than were written");
  }
  return SyncFolder(target);
}

}  // namespace veduta
