// SPDX-License-Identifier: Apache-2.0
// Goal: RocksDB's failures come out in our codes, and a full disk is named as such wherever RocksDB
//   mentions it.
// Method: one status of each kind.
#include "storage/rocksdb_status.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(RocksdbStatus, CodesAreOurs) {
  EXPECT_TRUE(FromRocksdb(rocksdb::Status::OK(), "read").ok());
  EXPECT_EQ(FromRocksdb(rocksdb::Status::NotFound(), "read").code(), StatusCode::kNotFound);
  EXPECT_EQ(FromRocksdb(rocksdb::Status::Corruption("x"), "read").code(), StatusCode::kCorruption);
  EXPECT_EQ(FromRocksdb(rocksdb::Status::InvalidArgument(), "read").code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(FromRocksdb(rocksdb::Status::Busy(), "read").code(), StatusCode::kBusy);
  EXPECT_EQ(FromRocksdb(rocksdb::Status::Aborted(), "read").code(), StatusCode::kIoError);
  const Status io = FromRocksdb(rocksdb::Status::IOError("a file", "broken"), "read the file");
  EXPECT_EQ(io.code(), StatusCode::kIoError);
  EXPECT_TRUE(io.message().starts_with("cannot read the file: ")) << io.message();
}

TEST(RocksdbStatus, FileThatCouldNotBeReadOnceIsNoInvalidArgument) {
  const auto status =
      rocksdb::Status::InvalidArgument("Direct I/O is not supported by the specified DB.");
  EXPECT_EQ(FromRocksdb(status, "open").code(), StatusCode::kIoError);
  const auto folder = rocksdb::Status::Corruption("Can't list files in a: IO error: broken");
  EXPECT_EQ(FromRocksdb(folder, "open").code(), StatusCode::kIoError);
  const auto table = rocksdb::Status::Corruption("Can't access /1.sst: IO error: broken");
  EXPECT_EQ(FromRocksdb(table, "open").code(), StatusCode::kIoError);
  const auto missing = rocksdb::Status::Corruption("Can't access /1.sst: IO error: No such file");
  EXPECT_EQ(FromRocksdb(missing, "open").code(), StatusCode::kCorruption);
}

TEST(RocksdbStatus, FullDiskIsNamed) {
  for (const rocksdb::Status& full :
       {rocksdb::Status::NoSpace(), rocksdb::Status::IOError("No space left on device"),
        rocksdb::Status::Corruption("While appending: No space left on device")}) {
    const Status status = FromRocksdb(full, "write");
    EXPECT_EQ(status.code(), StatusCode::kIoError);
    EXPECT_NE(status.message().find("the disk is full: free some space"), std::string::npos)
        << status.message();
  }
}

}  // namespace
}  // namespace veduta
