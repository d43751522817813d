// SPDX-License-Identifier: Apache-2.0
// Goal: a file is read whole; whatever keeps it from being read is an error with its path and the
//   operating system's word, and a pipe is not waited for.
// Method: files, folders and pipes in a temporary folder.
#include "engine/photo/photo_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(PhotoFile, IsReadWholeUpToOneByteBeyondTheLimit) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.jpg") << "0123456789";
  EXPECT_EQ(PhotoFileSize(folder / "a.jpg"), 10u);
  EXPECT_EQ(ReadPhotoFile(folder / "a.jpg", 100)->size(), 10u);
  EXPECT_EQ(ReadPhotoFile(folder / "a.jpg", 10)->back(), '9');
  EXPECT_EQ(ReadPhotoFile(folder / "a.jpg", 4)->size(), 5u);
}

TEST(PhotoFile, WhatCannotBeReadIsAnErrorThatNamesIt) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  ASSERT_EQ(mkdir((folder / "folder").c_str(), 0700), 0);
  const auto absent = ReadPhotoFile(folder / "absent", 100);
  EXPECT_EQ(absent.status().code(), StatusCode::kNotFound);
  EXPECT_NE(absent.status().message().find(folder / "absent"), std::string::npos);
  EXPECT_NE(absent.status().message().find("No such file"), std::string::npos);
  for (const char* name : {"pipe", "folder"}) {
    EXPECT_EQ(ReadPhotoFile(folder / name, 100).status().code(), StatusCode::kIoError) << name;
    EXPECT_EQ(PhotoFileSize(folder / name), 0u) << name;
  }
}

}  // namespace
}  // namespace veduta
