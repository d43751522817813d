// SPDX-License-Identifier: Apache-2.0
// Goal: a log that RocksDB or LogWriter wrote is read record by record, and behind damage the
//   reader goes on with the next record.
// Method: records of sizes around those of blocks; every kind of damage at a known record.
#include "storage/log_reader.h"

#include <gtest/gtest.h>
#include <rocksdb/db.h>
#include <rocksdb/write_batch.h>

#include <filesystem>
#include <fstream>
#include <tuple>

#include "samples.h"
#include "storage/log_format.h"
#include "storage/log_names.h"
#include "storage/log_writer.h"

namespace veduta {
namespace {

struct Piece {
  LogPiece piece;
  std::string batch;
};

std::vector<Piece> PiecesOf(const std::string& path) {
  std::vector<Piece> pieces;
  EXPECT_OK(ReadLog(*rocksdb::FileSystem::Default(), path, [&](const LogPiece& piece) {
    pieces.push_back({piece, std::string(piece.record)});
    return Status::Ok();
  }));
  return pieces;
}

// Of one write each, with sequence numbers from 1.
std::string Record(uint64_t sequence, size_t size_bytes) {
  std::string record;
  AppendLittleEndian(sequence, &record);
  AppendLittleEndian(uint32_t{1}, &record);
  const auto data = SampleBytes(sequence, size_bytes - record.size());
  record.append(data.begin(), data.end());
  return record;
}

void WriteLog(const std::string& path, const std::vector<size_t>& sizes) {
  auto writer = LogWriter::Make(*rocksdb::FileSystem::Default(), path);
  ASSERT_OK(writer);
  for (size_t i = 0; i < sizes.size(); ++i) ASSERT_OK(writer->Add(Record(i + 1, sizes[i])));
  ASSERT_OK(writer->Finish());
}

void Change(const std::string& path, uint64_t offset, const std::string& bytes) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(offset));
  file << bytes;
}

const std::vector<size_t> kSizes = {12,     100,    32742, 32749, 20,      32768 - 7,
                                    32'768, 32'769, 13,    70000, 200'000, 40};

TEST(LogReader, ReadsWhatLogWriterWrites) {
  const TemporaryFolder folder;
  WriteLog(folder / "log", kSizes);
  const auto pieces = PiecesOf(folder / "log");
  ASSERT_EQ(pieces.size(), kSizes.size());
  for (size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_TRUE(pieces[i].piece.readable);
    EXPECT_EQ(pieces[i].piece.sequence, i + 1);
    EXPECT_EQ(pieces[i].piece.count, 1u);
    EXPECT_EQ(pieces[i].batch, Record(i + 1, kSizes[i])) << i;
  }
  EXPECT_EQ(pieces.back().piece.end_bytes, std::filesystem::file_size(folder / "log"));
}

TEST(LogReader, ReadsWhatRocksdbWrites) {
  const TemporaryFolder folder;
  rocksdb::Options options;
  options.create_if_missing = true;
  rocksdb::DB* db = nullptr;
  ASSERT_TRUE(rocksdb::DB::Open(options, folder / "db", &db).ok());
  uint64_t sequence = 1;
  for (int i = 0; i < 50; ++i) {
    rocksdb::WriteBatch batch;
    for (int write = 0; write <= i % 3; ++write)
      ASSERT_TRUE(batch.Put("key " + std::to_string(write), std::string(i * 997, 'x')).ok());
    ASSERT_TRUE(db->Write(rocksdb::WriteOptions(), &batch).ok());
  }
  const auto logs = ListLogs(*rocksdb::FileSystem::Default(), folder / "db");
  ASSERT_OK(logs);
  const auto pieces = PiecesOf(folder / "db/" + LogName(logs->back()));
  ASSERT_EQ(pieces.size(), 50u);
  for (size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_EQ(pieces[i].piece.sequence, sequence);
    EXPECT_EQ(pieces[i].piece.count, i % 3 + 1);
    sequence += i % 3 + 1;
  }
  delete db;
}

// The one unreadable piece among those of a log of kSizes, and which records are missing.
Piece OnlyUnreadable(const std::string& path, const std::vector<uint64_t>& missing) {
  Piece unreadable;
  std::vector<uint64_t> read;
  size_t count = 0;
  for (const Piece& piece : PiecesOf(path)) {
    if (piece.piece.readable) {
      read.push_back(piece.piece.sequence);
      EXPECT_EQ(piece.batch, Record(read.back(), kSizes[read.back() - 1]));
    } else {
      unreadable = piece;
      ++count;
    }
  }
  EXPECT_EQ(count, 1u);
  std::vector<uint64_t> expected;
  for (uint64_t i = 1; i <= kSizes.size(); ++i)
    if (std::find(missing.begin(), missing.end(), i) == missing.end()) expected.push_back(i);
  EXPECT_EQ(read, expected);
  return unreadable;
}

TEST(LogReader, GoesOnBehindEachDamagedRecord) {
  const TemporaryFolder folder;
  WriteLog(folder / "whole", kSizes);
  const auto whole = PiecesOf(folder / "whole");
  for (size_t i = 0; i < kSizes.size(); ++i) {
    // The checksum, the length, the type, the batch's count, and its middle.
    const LogPiece& record = whole[i].piece;
    const uint64_t middle = (record.begin_bytes + record.end_bytes) / 2;
    for (const uint64_t offset : {record.begin_bytes, record.begin_bytes + 5,
                                  record.begin_bytes + 6, record.begin_bytes + 16, middle}) {
      SCOPED_TRACE("record " + std::to_string(i + 1) + ", byte " + std::to_string(offset));
      std::filesystem::copy_file(folder / "whole", folder / "log",
                                 std::filesystem::copy_options::overwrite_existing);
      std::ifstream file(folder / "whole", std::ios::binary);
      file.seekg(static_cast<std::streamoff>(offset));
      Change(folder / "log", offset, std::string(1, static_cast<char>(file.get() ^ 0x40)));
      const LogPiece bad = OnlyUnreadable(folder / "log", {i + 1}).piece;
      EXPECT_EQ(bad.begin_bytes, record.begin_bytes);
      EXPECT_LE(bad.end_bytes, record.end_bytes);
      // The last record is then longer than the file.
      const bool is_length = offset == record.begin_bytes + 5;
      EXPECT_EQ(bad.may_be_unwritten, i + 1 == kSizes.size() && is_length);
    }
  }
}

TEST(LogReader, TornEndAndMissingPageMayBeUnwritten) {
  const TemporaryFolder folder;
  WriteLog(folder / "log", kSizes);
  const auto whole = PiecesOf(folder / "log");
  const uint64_t page = (whole[10].piece.begin_bytes / 4096 + 3) * 4096;
  Change(folder / "log", page, std::string(4096, '\0'));
  EXPECT_TRUE(OnlyUnreadable(folder / "log", {11}).piece.may_be_unwritten);
  for (const uint64_t size : {whole[10].piece.end_bytes + 3, whole[10].piece.end_bytes - 1,
                              whole[10].piece.begin_bytes + 40'000}) {
    WriteLog(folder / "log", kSizes);
    std::filesystem::resize_file(folder / "log", size);
    const bool only_last = size > whole[10].piece.end_bytes;
    const auto missing = only_last ? std::vector<uint64_t>{12} : std::vector<uint64_t>{11, 12};
    EXPECT_TRUE(OnlyUnreadable(folder / "log", missing).piece.may_be_unwritten);
  }
}

TEST(LogReader, PartsOfPagesMayBeUnwritten) {
  const TemporaryFolder folder;
  WriteLog(folder / "log", kSizes);
  const LogPiece record = PiecesOf(folder / "log")[10].piece;
  const uint64_t page = (record.begin_bytes / 4096 + 3) * 4096;
  const std::vector<std::tuple<uint64_t, uint64_t, bool>> cases = {
      {page + 900, 4096 - 900, true},  // what came since the last sync
      {page + 4096 - 512, 512, true},
      {page + 1024, 512, true},
      {page + 1023, 512, false},  // two sectors hold bytes
      {page + 1000, 500, false}};
  for (const auto& [begin, count, expected] : cases) {
    SCOPED_TRACE(std::to_string(count) + " zeros from byte " + std::to_string(begin - page));
    WriteLog(folder / "log", kSizes);
    Change(folder / "log", begin, std::string(count, '\0'));
    EXPECT_EQ(OnlyUnreadable(folder / "log", {11}).piece.may_be_unwritten, expected);
  }
}

TEST(LogReader, NamesAreThoseOfRocksdb) {
  EXPECT_EQ(LogName(7), "000007.log");
  EXPECT_EQ(LogName(12'345'678), "12345678.log");
  EXPECT_EQ(ParseLogName("000007.log"), 7u);
  EXPECT_EQ(ParseLogName("7.log.anew"), std::nullopt);
  EXPECT_EQ(ParseLogName("x7.log"), std::nullopt);
  EXPECT_EQ(ParseLogName(".log"), std::nullopt);
}

}  // namespace
}  // namespace veduta
