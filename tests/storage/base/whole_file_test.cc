// SPDX-License-Identifier: Apache-2.0
// Goal: a file is read whole up to the limit, byte by byte, and refused beyond it; what cannot be
//   read is an error that names the path.
// Method: files of the limit's size and one byte more, larger than the reader's buffer; a missing
//   file, a folder, a pipe that nobody writes to, a socket, a device without end.
#include "storage/base/whole_file.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace veduta {
namespace {

TEST(WholeFile, UpToTheLimitAndNoFurther) {
  const std::string path = (std::filesystem::path(::testing::TempDir()) /
                            ("veduta_whole_file_" + std::to_string(getpid())))
                               .string();
  constexpr size_t kLimit = 200'000;  // several of the reader's buffers
  std::string bytes;
  for (size_t i = 0; i < kLimit; ++i) bytes += static_cast<char>(i * i >> 4);
  std::ofstream(path, std::ios::binary) << bytes;
  const Result<std::string> read = ReadWholeFile(path, kLimit);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_TRUE(*read == bytes);
  std::ofstream(path, std::ios::binary | std::ios::app) << 'x';
  const Status refused = ReadWholeFile(path, kLimit).status();
  EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(refused.message().find(path), std::string::npos);
  EXPECT_NE(refused.message().find("200000"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(WholeFile, WhatCannotBeReadIsNamed) {
  for (const std::string path : {"no such file", "/"}) {
    const Status status = ReadWholeFile(path, 10).status();
    EXPECT_EQ(status.code(), StatusCode::kIoError) << path;
    EXPECT_NE(status.message().find(path), std::string::npos);
  }
}

TEST(WholeFile, NeverWaitsForAnotherProcess) {
  const std::string folder =
      (std::filesystem::path(::testing::TempDir()) / ("veduta_no_file_" + std::to_string(getpid())))
          .string();
  std::filesystem::create_directories(folder);
  const std::string pipe = folder + "/pipe", unix_socket = folder + "/socket";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  ASSERT_LT(unix_socket.size(), sizeof(address.sun_path));
  unix_socket.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int number = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(number, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  const std::pair<std::string, std::string> kinds[] = {
      {pipe, "a pipe"}, {unix_socket, "a socket"}, {"/dev/zero", "a device"}, {folder, "a folder"}};
  for (const auto& [path, what] : kinds) {
    const Status status = ReadWholeFile(path, 10).status();
    EXPECT_EQ(status.code(), StatusCode::kIoError) << path;
    EXPECT_EQ(status.message(), path + " is " + what + ", not a file");
  }
  close(number);
  std::filesystem::remove_all(folder);
}

TEST(WholeFile, FilesOfNoSizeAreReadToTheirEnd) {
  const Result<std::string> read = ReadWholeFile("/proc/self/stat", 1 << 20);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_GT(read->size(), 10u);
  EXPECT_EQ(ReadWholeFile("/proc/self/stat", 3).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
