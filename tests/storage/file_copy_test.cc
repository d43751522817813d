// SPDX-License-Identifier: Apache-2.0
// Goal: a copy has the bytes of the file and says their hash, or is not there.
// Method: files of lengths about the piece that is read at once; one that is missing, a stop, and a
//   limit on the size of files in place of a full disk.
#include "storage/file_copy.h"

#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

void Write(const std::string& path, const std::vector<uint8_t>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

TEST(FileCopy, HasTheBytesAndSaysTheirHash) {
  const TemporaryFolder folder;
  for (const size_t size : {0, 1, (1 << 20) - 1, 1 << 20, (1 << 20) + 1, 3'000'000}) {
    const std::vector<uint8_t> bytes = SampleBytes(size, size);
    Write(folder / "from", bytes);
    const auto copied = CopyFile(folder / "from", folder / "to", {});
    ASSERT_OK(copied);
    EXPECT_EQ(*copied, HashContent(bytes));
    const auto hash = HashFile(folder / "to", {});
    ASSERT_OK(hash);
    EXPECT_EQ(*hash, *copied);
  }
}

TEST(FileCopy, OneThatFailsLeavesNothing) {
  const TemporaryFolder folder;
  EXPECT_EQ(CopyFile(folder / "none", folder / "to", {}).status().code(), StatusCode::kIoError);
  Write(folder / "from", SampleBytes(1, 100));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(CopyFile(folder / "from", folder / "to", stop.get_token()).status().code(),
            StatusCode::kCancelled);
  EXPECT_FALSE(fs::exists(folder / "to"));
  EXPECT_FALSE(WriteFileWhole(folder / "no folder/a", "text").ok());
}

// Ends the process with 0 where the copy failed, said why, and is not there.
void CopyWhereFilesAreSmall(const std::string& from, const std::string& to) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{1 << 20, 1 << 20};
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0) std::exit(1);
  const Status failed = CopyFile(from, to, {}).status();
  const bool is_told = failed.message().find("File too large") != std::string::npos;
  std::exit(is_told && !fs::exists(to) ? 0 : 1);
}

TEST(FileCopyDeathTest, AFullDiskIsTold) {
  const TemporaryFolder folder;
  Write(folder / "from", SampleBytes(1, 2 << 20));
  EXPECT_EXIT(CopyWhereFilesAreSmall(folder / "from", folder / "to"), testing::ExitedWithCode(0),
              "");
}

TEST(FileCopy, ASmallFileIsWrittenWhole) {
  const TemporaryFolder folder;
  ASSERT_OK(WriteFileWhole(folder / "a", "old and long"));
  ASSERT_OK(WriteFileWhole(folder / "a", "new"));
  const auto hash = HashFile(folder / "a", {});
  ASSERT_OK(hash);
  const std::string text = "new";
  EXPECT_EQ(*hash, HashContent({reinterpret_cast<const uint8_t*>(text.data()), text.size()}));
  EXPECT_FALSE(fs::exists(folder / "a.new"));
}

}  // namespace
}  // namespace veduta
