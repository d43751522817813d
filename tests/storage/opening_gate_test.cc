// SPDX-License-Identifier: Apache-2.0
// Goal: no file is deleted while a reader opens the database; nobody waits for ever, whoever comes
//   and goes.
// Method: gates that are held while files of a folder are deleted.
#include "storage/opening_gate.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "samples.h"
#include "storage/database_opener.h"

namespace veduta {
namespace {

class OpeningGateTest : public testing::Test {
 protected:
  void SetUp() override { std::ofstream(folder_ / kMarkerFile) << "ours"; }

  void Make(const std::string& name) { std::ofstream(folder_ / name) << "some"; }
  bool Holds(const std::string& name) { return std::filesystem::exists(folder_ / name); }
  void Delete(const std::string& name) {
    EXPECT_TRUE(files_.DeleteFile(folder_ / name, {}, nullptr).ok());
  }

  const TemporaryFolder folder_;
  GatedDeletions files_{rocksdb::FileSystem::Default(), folder_.path()};
};

TEST_F(OpeningGateTest, FilesAreDeletedAfterTheReadersHaveOpened) {
  Make("table");
  std::thread deleter;
  {
    const OpeningGate one = OpeningGate::EnterToOpen(folder_.path());
    const OpeningGate other = OpeningGate::EnterToOpen(folder_.path());
    EXPECT_TRUE(one.is_held() && other.is_held());
    deleter = std::thread([&] { Delete("table"); });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_TRUE(Holds("table"));
  }
  deleter.join();
  EXPECT_FALSE(Holds("table"));
}

// Each reader is inside before the one before it leaves, so that one is inside at any time.
TEST_F(OpeningGateTest, WriterIsLetInThoughReadersComeAllTheTime) {
  std::atomic<bool> stop = false;
  std::vector<std::thread> readers;
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      while (!stop) {
        const OpeningGate gate = OpeningGate::EnterToOpen(folder_.path());
        EXPECT_TRUE(gate.is_held());
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(OpeningGate::EnterToDelete(folder_.path(), /*waits=*/true).is_held());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
}

TEST_F(OpeningGateTest, ReaderThatNeverEndsIsWaitedForOnce) {
  const OpeningGate stuck = OpeningGate::EnterToOpen(folder_.path());
  for (const std::string name : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
    Make(name);
    Delete(name);
    EXPECT_FALSE(Holds(name));
  }
}

TEST_F(OpeningGateTest, WithoutTheFileOfLocksNobodyWaits) {
  std::filesystem::remove(folder_ / kMarkerFile);
  EXPECT_FALSE(OpeningGate::EnterToOpen(folder_.path()).is_held());
  Make("table");
  Delete("table");
  EXPECT_FALSE(Holds("table"));
}

}  // namespace
}  // namespace veduta
