// SPDX-License-Identifier: Apache-2.0
#pragma once
// A database with commits in its log, as a killed process leaves it, and ways to damage that log.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <system_error>
#include <vector>

#include "damage.h"
#include "samples.h"
#include "storage/log_names.h"
#include "storage/log_reader.h"

namespace veduta {

// What AddImage adds to the log: the photo, its features, the commit.
inline constexpr size_t kRecordsOfAnImage = 3;

inline Status AddImage(Database& database, uint32_t id, size_t photo_bytes = 3000) {
  VEDUTA_RETURN_IF_ERROR(database.WritePhotoAhead(SampleHash(id), SampleBytes(id, photo_bytes),
                                                  SampleFeatures(id, 5)));
  const auto transaction = database.BeginTransaction();
  DatabaseState state = *transaction->base()->GetState();
  state.next_image = id + 1;
  transaction->PutImage(SampleImage(id));
  transaction->PutState(state);
  return transaction->Commit();
}

// What the folder holds while the database is open is what a killed process would leave. RocksDB
// deletes files in the background: a copy during which the folder has changed is made again.
inline void CopyAsKilled(const std::string& from, const std::string& to) {
  const auto list = [&] {
    std::map<std::string, uint64_t> sizes;
    std::error_code gone;
    for (const auto& entry : std::filesystem::directory_iterator(from))
      sizes[entry.path().filename()] = entry.is_regular_file(gone) ? entry.file_size(gone) : 0;
    return sizes;
  };
  for (int attempt = 0; attempt < 100; ++attempt) {
    const auto before = list();
    std::error_code failed;
    std::filesystem::remove_all(to);
    std::filesystem::copy(from, to, std::filesystem::copy_options::recursive, failed);
    if (!failed && list() == before) return;
  }
  ADD_FAILURE() << from << " never stays as it is";
}

// Copies the database as a killed process leaves it that has made a table of the family photos
// alone: the first log is still needed, and holds `records` records.
inline void CopyWithPhotosFlushed(const std::string& from, const std::string& to, int records) {
  const auto act = [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* photos) {
    for (int i = 0; i < records; ++i) {
      ASSERT_TRUE(db.Put({}, "key " + std::to_string(i), "of the unused default family").ok());
    }
    ASSERT_TRUE(db.Put({}, photos, "photo", "its bytes").ok());
    ASSERT_TRUE(db.Flush({}, photos).ok());
    ASSERT_TRUE(db.Put({}, "last key", "in the second log").ok());
    CopyAsKilled(from, to);
    ASSERT_TRUE(db.Delete({}, photos, "photo").ok());
  };
  WithRocksdb(from, act, Family::kPhotos);
}

inline std::vector<std::string> LogsOf(const std::string& folder) {
  std::vector<std::string> paths;
  for (const uint64_t log : *ListLogs(*rocksdb::FileSystem::Default(), folder))
    paths.push_back(folder + "/" + LogName(log));
  return paths;
}

inline std::vector<LogPiece> PiecesOfLog(const std::string& path) {
  std::vector<LogPiece> pieces;
  EXPECT_OK(ReadLog(*rocksdb::FileSystem::Default(), path, [&](const LogPiece& piece) {
    pieces.push_back(piece);
    return Status::Ok();
  }));
  return pieces;
}

inline void FlipBit(const std::string& path, uint64_t offset) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  const char byte = static_cast<char>(file.get() ^ 0x04);
  file.seekp(static_cast<std::streamoff>(offset));
  file.put(byte);
}

inline uint32_t CountImages(const Database& database) {
  uint32_t count = 0;
  EXPECT_OK(database.GetSnapshot()->ScanImages([&](const ImageRecord&) { return ++count, true; }));
  return count;
}

}  // namespace veduta
