// SPDX-License-Identifier: Apache-2.0
// Goal: a file that the user asked for has the bytes, or the failure names it and the cause.
// Method: a temporary folder, a folder that is missing, and the device that is always full.
#include "cli/result_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace veduta {
namespace {

TEST(ResultFile, HasTheBytesAndNoOthers) {
  const std::string path = testing::TempDir() + "veduta_result_" + std::to_string(getpid());
  const std::string_view bytes("a\0\n\xff", 4);
  ASSERT_TRUE(WriteResultFile(path, "what was there before, and longer").ok());
  ASSERT_TRUE(WriteResultFile(path, bytes).ok());
  std::stringstream written;
  written << std::ifstream(path, std::ios::binary).rdbuf();
  EXPECT_EQ(written.str(), bytes);
  std::filesystem::remove(path);
}

TEST(ResultFile, AFailureNamesFileAndCause) {
  const Status missing = WriteResultFile("/no such folder/a.pdf", "x");
  EXPECT_EQ(missing.code(), StatusCode::kIoError);
  EXPECT_EQ(missing.message(), "cannot write /no such folder/a.pdf: No such file or directory");
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no device that is always full";
  EXPECT_EQ(WriteResultFile("/dev/full", "x").message(),
            "cannot write /dev/full: No space left on device");
}

}  // namespace
}  // namespace veduta
