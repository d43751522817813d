// SPDX-License-Identifier: Apache-2.0
// Goal: a file is read whole up to the limit, byte by byte, and refused beyond it; what cannot be
//   read is an error that names the path.
// Method: files of the limit's size and one byte more, larger than the reader's buffer; a missing
//   file, a folder.
#include "engine/camera/files/whole_file.h"

#include <gtest/gtest.h>
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

}  // namespace
}  // namespace veduta
