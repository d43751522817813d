// SPDX-License-Identifier: Apache-2.0
// Goal: a backup is a copy that can be read to its last byte, or there is none and the failure says
//   what is damaged.
// Method: a byte of a stored photo, and one of a table, is flipped before a checkpoint is made; one
//   is made of more files than the process may open, and one during which the files are closed.
#include "storage/maintenance.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <iostream>

#include "tests/storage/on_first_table.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

class CheckpointTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    auto database = Database::Open(path_, options);
    ASSERT_OK(database);
    ASSERT_OK((*database)->WritePhotoAhead(HashContent(photo_), photo_, SampleFeatures(3, 4)));
    auto transaction = (*database)->BeginTransaction();
    ImageRecord image = SampleImage(1);
    image.photo = HashContent(photo_);
    image.verdict = Verdict::kPostponed;
    image.reason = Reason::kNoCandidates;
    transaction->PutImage(image);
    ASSERT_OK(transaction->Commit());
    ASSERT_OK((*database)->Compact());
  }

  // Flips the byte after the first occurrence of `wanted` in a file with this extension.
  void FlipAfter(const std::string& wanted, const std::string& extension) {
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      if (entry.path().extension() != extension) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
      const size_t at = bytes.find(wanted);
      if (at == std::string::npos) continue;
      bytes[at + wanted.size()] ^= 1;
      std::ofstream(entry.path(), std::ios::binary) << bytes;
      return;
    }
    ADD_FAILURE() << "no file has these bytes";
  }

  Status Copy() {
    auto database = Database::Open(path_, {});
    EXPECT_OK(database);
    EXPECT_OK((*database)->CreateCheckpoint(folder_ / "copy"));
    const Status copied = (*database)->CheckCheckpoint(folder_ / "copy");
    EXPECT_EQ(copied.ok(), std::filesystem::exists(folder_ / "copy"));
    return copied;
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "db";
  const std::vector<uint8_t> photo_ = SampleBytes(1, 5000);
};

TEST_F(CheckpointTest, OfAWholeDatabaseIsThere) {
  EXPECT_OK(Copy());
}

// Ends the process with 0 where a checkpoint of many files was made.
void CopyManyFilesWithFewOpen(const std::string& folder) {
  const rlimit limit{96, 96};
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0) std::exit(1);
  const auto database = MustCreate(folder + "/many");
  Status done;
  for (uint64_t i = 0; i < 40 && done.ok(); ++i) {  // two blob files each
    done = database->WritePhotoAhead(SampleHash(i), SampleBytes(i, 5000), SampleFeatures(i, 4));
    if (done.ok()) done = database->Compact();
  }
  if (done.ok()) done = database->CreateCheckpoint(folder + "/copy");
  if (done.ok()) done = database->CheckCheckpoint(folder + "/copy");
  if (!done.ok()) std::cerr << done.message() << std::endl;
  std::exit(done.ok() ? 0 : 1);
}

TEST_F(CheckpointTest, NeedsFewOpenFiles) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(CopyManyFilesWithFewOpen(folder_ / "."), testing::ExitedWithCode(0), "");
}

TEST_F(CheckpointTest, IsReadWhileTheDatabaseMayBeOpenedAgain) {
  std::unique_ptr<Database> database;
  std::future<Status> reopened;
  bool has_ended = false;
  DatabaseOptions options;
  options.file_system = std::make_shared<OnFirstTable>("/copy/", [&] {
    reopened = std::async(std::launch::async, [&] { return database->Reopen(); });
    has_ended = reopened.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
  });
  database = MustOpen(path_, options);
  ASSERT_OK(database->CreateCheckpoint(folder_ / "copy"));
  EXPECT_FALSE(reopened.valid()) << "nothing is read before the check";
  ASSERT_OK(database->CheckCheckpoint(folder_ / "copy"));
  EXPECT_TRUE(has_ended);
  EXPECT_OK(reopened.get());
}

TEST_F(CheckpointTest, NamesADamagedPhoto) {
  FlipAfter(std::string(photo_.begin(), photo_.begin() + 100), ".blob");
  const Status copied = Copy();
  EXPECT_EQ(copied.code(), StatusCode::kCorruption);
  EXPECT_NE(copied.message().find("family photos, key"), std::string::npos) << copied.message();
}

TEST_F(CheckpointTest, NamesADamagedTable) {
  FlipAfter(SampleImage(1).name.substr(0, 6), ".sst");
  const Status copied = Copy();
  EXPECT_EQ(copied.code(), StatusCode::kCorruption);
  EXPECT_NE(copied.message().find("family "), std::string::npos) << copied.message();
}

}  // namespace
}  // namespace veduta
