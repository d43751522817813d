// SPDX-License-Identifier: Apache-2.0
// Goal: flipped bytes and cuts of a blob file are noticed, and those of a table's blocks, too.
// Method: the files of a small database, changed at one byte after another.
#include "storage/table_check.h"

#include <filesystem>
#include <fstream>

#include "storage/database.h"
#include "storage/file_copy.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

std::string BytesOf(const std::string& path) {
  std::string bytes;
  EXPECT_OK(ReadPieces(path, {}, [&](std::string_view piece) {
    bytes += piece;
    return Status::Ok();
  }));
  return bytes;
}

class TableCheckTest : public testing::Test {
 protected:
  // The files with this ending, as they were written.
  std::vector<std::string> Files(const std::string& ending) {
    if (!std::filesystem::exists(path_)) {
      const auto database = MustCreate(path_);
      EXPECT_OK(
          database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 700), SampleFeatures(1, 2)));
      EXPECT_OK(
          database->WritePhotoAhead(SampleHash(2), SampleBytes(2, 300), SampleFeatures(2, 2)));
      EXPECT_OK(database->Compact());
    }
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      if (entry.path().extension() == ending) files.push_back(entry.path().string());
    }
    EXPECT_FALSE(files.empty());
    return files;
  }
  Status Check(const std::string& bytes, const std::string& ending) {
    const std::string path = folder_ / ("changed" + ending);
    std::ofstream(path, std::ios::binary) << bytes;
    return CheckStoredFile(path, {});
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
};

TEST_F(TableCheckTest, WholeFilesAreFine) {
  for (const char* ending : {".sst", ".blob"}) {
    for (const std::string& file : Files(ending)) EXPECT_OK(CheckStoredFile(file, {}));
  }
  EXPECT_OK(CheckStoredFile(path_ + "/CURRENT", {}));
}

TEST_F(TableCheckTest, ChangesOfABlobFileAreNoticed) {
  for (const std::string& file : Files(".blob")) {
    const std::string bytes = BytesOf(file);
    for (size_t i = 0; i < bytes.size(); i += i < 200 ? 1 : 7) {
      std::string changed = bytes;
      changed[i] = static_cast<char>(changed[i] ^ 0x10);
      const bool is_family_or_compression = (i >= 8 && i < 12) || i == 13;
      if (!is_family_or_compression) {
        EXPECT_EQ(Check(changed, ".blob").code(), StatusCode::kCorruption) << file << " " << i;
      }
      EXPECT_EQ(Check(bytes.substr(0, i), ".blob").code(), StatusCode::kCorruption) << i;
    }
    EXPECT_FALSE(Check(bytes + '\0', ".blob").ok());
  }
}

// A few bytes of a table are guarded by nothing: what fills it up.
TEST_F(TableCheckTest, NearlyEveryChangeOfATableIsNoticed) {
  for (const std::string& file : Files(".sst")) {
    const std::string bytes = BytesOf(file);
    size_t unnoticed = 0;
    for (size_t i = 0; i < bytes.size(); i += 7) {
      std::string changed = bytes;
      changed[i] = static_cast<char>(changed[i] ^ 0x10);
      unnoticed += Check(changed, ".sst").ok();
    }
    EXPECT_LE(unnoticed, bytes.size() / 7 / 10) << file << " of " << bytes.size();
    EXPECT_FALSE(Check(bytes.substr(0, bytes.size() / 2), ".sst").ok());
  }
}

TEST_F(TableCheckTest, AStopEndsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(CheckStoredFile(Files(".blob")[0], stop.get_token()).code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace veduta
