// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/repair_folders.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "storage/base/system_status.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

Status Sync(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = file >= 0 && fsync(file) == 0;
  const std::string word = std::strerror(errno);
  if (file >= 0) close(file);
  return synced ? Status::Ok() : Status::IoError("cannot make " + path + " durable: " + word);
}

Status SyncParent(const std::string& path) {
  const fs::path parent = fs::path(path).parent_path();
  return Sync(parent.empty() ? "." : parent.string());
}

Status DeleteFolder(const std::string& path) {
  std::error_code error;
  fs::remove_all(path, error);
  return FromSystem(error, "delete folder " + path);
}

Status RenameDurably(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::rename(from, to, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "rename " + from + " to " + to));
  return SyncParent(to);
}

// Whether the two folders have changed their names; false where the file system cannot do that.
Result<bool> Exchange(const std::string& a, const std::string& b) {
  if (renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) {
    VEDUTA_RETURN_IF_ERROR(SyncParent(a));
    return true;
  }
  if (errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP) return false;
  return Status::IoError("cannot exchange " + a + " and " + b + ": " + std::strerror(errno));
}

// What the system knows of a folder itself; false where there is none.
bool LookAt(const std::string& path, struct statx* found) {
  return statx(AT_FDCWD, path.c_str(), AT_NO_AUTOMOUNT, STATX_BASIC_STATS | STATX_BTIME, found) ==
         0;
}

// Tells a folder from others, also after it was renamed; empty where there is none. The time when
// it was made is part of it since numbers of deleted folders are given out again.
std::string IdentityOf(const std::string& path) {
  struct statx found = {};
  if (!LookAt(path, &found)) return "";
  const bool knows_birth = (found.stx_mask & STATX_BTIME) != 0;
  std::string identity;
  for (const int64_t number :
       {int64_t{found.stx_dev_major}, int64_t{found.stx_dev_minor},
        static_cast<int64_t>(found.stx_ino), knows_birth ? int64_t{found.stx_btime.tv_sec} : 0,
        knows_birth ? int64_t{found.stx_btime.tv_nsec} : 0})
    identity += std::to_string(number) + " ";
  return identity;
}

std::string ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Status DeleteFile(const std::string& path) {
  std::error_code error;
  fs::remove(path, error);
  return FromSystem(error, "delete " + path);
}

// The folder that a path leads to, without links and dots. Only its last part may be missing.
std::string RealPath(const std::string& path) {
  std::error_code error;
  fs::path real = path;
  // A link to a folder that is not there: a switch by two renames may have been cut short.
  if (fs::is_symlink(real, error) && !fs::exists(real, error))
    real = real.parent_path() / fs::read_symlink(real, error);
  real = fs::weakly_canonical(fs::absolute(real, error), error);
  if (error) real = path;
  if (!real.has_filename()) real = real.parent_path();
  return real.string();
}

bool HasBytes(const fs::path& path, const std::vector<uint8_t>& bytes) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  return std::ranges::equal(ReadText(path), bytes, {}, [](char c) { return uint8_t(c); });
}

}  // namespace

RepairFolders RepairFoldersFor(const std::string& path) {
  RepairFolders folders;
  folders.database = RealPath(path);
  folders.source = folders.database + ".repairing-source";
  folders.repairing = folders.database + ".repairing";
  folders.repaired = folders.database + ".repaired";
  folders.repaired_for = folders.database + ".repaired-for";
  for (int number = 1;; ++number) {
    folders.kept = folders.database + ".damaged-" + std::to_string(number);
    folders.report = folders.kept + ".txt";
    folders.photos = folders.kept + ".photos";
    if (!Exists(folders.kept)) return folders;
  }
}

bool HasFilesOfDatabase(const std::string& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename(), ending = entry.path().extension();
    if (name == "VEDUTA" || name == "CURRENT" || name.starts_with("MANIFEST-") ||
        ending == ".sst" || ending == ".blob" || ending == ".log")
      return true;
  }
  return false;
}

Status CheckCanBeRenamed(const RepairFolders& folders) {
  struct statx own = {}, parent = {};
  const std::string above = fs::path(folders.database).parent_path().string();
  if (!LookAt(folders.database, &own) || !LookAt(above, &parent)) return Status::Ok();
  const bool is_root = (own.stx_attributes & own.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT) != 0;
  if (!is_root && own.stx_dev_major == parent.stx_dev_major &&
      own.stx_dev_minor == parent.stx_dev_minor)
    return Status::Ok();
  return Status::InvalidArgument(
      "a file system is mounted at " + folders.database +
      ", and a repair has to rename the database's folder: mount the file system at the folder "
      "above, or copy the database to another folder, and repair it there");
}

SwitchState FindSwitch(const RepairFolders& folders) {
  if (!Exists(folders.repaired)) return SwitchState::kNone;
  if (!Exists(folders.database)) return SwitchState::kMovedAway;
  const std::string replaces = ReadText(folders.repaired_for);
  if (!replaces.empty() && replaces == IdentityOf(folders.database)) return SwitchState::kNone;
  if (!replaces.empty() && replaces == IdentityOf(folders.repaired)) return SwitchState::kExchanged;
  return SwitchState::kReplaced;
}

Status CompleteSwitch(const RepairFolders& folders) {
  VEDUTA_RETURN_IF_ERROR(WriteTextDurably(folders.repaired_for, IdentityOf(folders.database)));
  return RenameDurably(folders.repairing, folders.repaired);
}

Status BeginSwitch(const RepairFolders& folders, bool may_exchange) {
  if (may_exchange) {
    VEDUTA_ASSIGN_OR_RETURN(const bool exchanged, Exchange(folders.repaired, folders.database));
    if (exchanged) return Status::Ok();
  }
  return RenameDurably(folders.database, folders.kept);
}

Status FinishSwitch(const RepairFolders& folders) {
  const bool is_exchanged = Exists(folders.database);
  VEDUTA_RETURN_IF_ERROR(
      RenameDurably(folders.repaired, is_exchanged ? folders.kept : folders.database));
  return DeleteFile(folders.repaired_for);
}

Status DeleteLeftovers(const RepairFolders& folders) {
  if (FindSwitch(folders) == SwitchState::kReplaced) {
    return Status::AlreadyExists(
        folders.repaired + " is a complete database that a repair has made, and " +
        folders.database +
        " is not the database that it was made from: rename or delete one of the two, then repair "
        "again");
  }
  VEDUTA_RETURN_IF_ERROR(DeleteFolder(folders.source));
  VEDUTA_RETURN_IF_ERROR(DeleteFolder(folders.repairing));
  // The database was not replaced yet, and somebody may have written to it since.
  if (FindSwitch(folders) != SwitchState::kNone) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(DeleteFolder(folders.repaired));
  return DeleteFile(folders.repaired_for);
}

Status CheckRoom(const RepairFolders& folders) {
  std::error_code error;
  uint64_t needed = 0;
  for (const auto& entry : fs::directory_iterator(folders.database, error)) {
    std::error_code unreadable;
    const uint64_t size_bytes = entry.file_size(unreadable);
    if (!unreadable) needed += size_bytes;
  }
  const fs::space_info room = fs::space(folders.database, error);
  if (error || room.available >= needed) return Status::Ok();
  return Status::IoError("repairing " + folders.database + " takes " + std::to_string(needed) +
                         " bytes beside it, and the disk has " + std::to_string(room.available) +
                         ": make room");
}

Status WriteFileInside(const std::string& folder, const std::string& name,
                       const std::string& prefix, const std::vector<uint8_t>& bytes) {
  fs::path path = folder;
  for (const fs::path& part : fs::path(name).relative_path()) {
    if (part != ".." && part != ".") path /= part;
  }
  std::error_code error;
  fs::create_directories(folder, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "make folder " + folder));
  if (HasBytes(path, bytes)) return Status::Ok();
  fs::create_directories(path.parent_path(), error);
  const bool is_blocked = error == std::errc::not_a_directory || error == std::errc::file_exists;
  if (is_blocked || Exists(path)) {
    path = fs::path(folder) / (prefix + "-" + path.filename().string());
  } else {
    VEDUTA_RETURN_IF_ERROR(FromSystem(error, "make folder " + path.parent_path().string()));
  }
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  return file ? Sync(path) : Status::IoError("cannot write " + path.string());
}

Status WriteTextDurably(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) return Status::IoError("cannot write " + path);
  VEDUTA_RETURN_IF_ERROR(Sync(path));
  return SyncParent(path);
}

}  // namespace veduta
