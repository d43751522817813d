// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/repair_folders.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace veduta {
namespace {

namespace fs = std::filesystem;

Status FromSystem(const std::error_code& error, const std::string& doing) {
  if (!error) return Status::Ok();
  return Status::IoError("cannot " + doing + ": " + error.message());
}

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

}  // namespace

RepairFolders RepairFoldersFor(const std::string& path) {
  RepairFolders folders;
  folders.database = path;
  while (folders.database.size() > 1 && folders.database.ends_with('/'))
    folders.database.pop_back();
  folders.source = folders.database + ".repairing-source";
  folders.repairing = folders.database + ".repairing";
  folders.repaired = folders.database + ".repaired";
  for (int number = 1;; ++number) {
    folders.kept = folders.database + ".damaged-" + std::to_string(number);
    folders.report = folders.kept + ".txt";
    folders.photos = folders.kept + ".photos";
    if (!Exists(folders.kept)) return folders;
  }
}

bool IsSwitchUnfinished(const RepairFolders& folders) {
  return !Exists(folders.database) && Exists(folders.repaired);
}

Status FinishSwitch(const RepairFolders& folders) {
  return RenameDurably(folders.repaired, folders.database);
}

Status DeleteLeftovers(const RepairFolders& folders) {
  VEDUTA_RETURN_IF_ERROR(DeleteFolder(folders.source));
  VEDUTA_RETURN_IF_ERROR(DeleteFolder(folders.repairing));
  // Where the database is there too, somebody may have written to it since.
  return Exists(folders.database) ? DeleteFolder(folders.repaired) : Status::Ok();
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

Status RenameDurably(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::rename(from, to, error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "rename " + from + " to " + to));
  return SyncParent(to);
}

Status WriteFileInside(const std::string& folder, const std::string& name,
                       const std::vector<uint8_t>& bytes) {
  fs::path path = folder;
  for (const fs::path& part : fs::path(name).relative_path()) {
    if (part != ".." && part != ".") path /= part;
  }
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  VEDUTA_RETURN_IF_ERROR(FromSystem(error, "make folder " + path.parent_path().string()));
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
