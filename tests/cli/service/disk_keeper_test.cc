// SPDX-License-Identifier: Apache-2.0
// Goal: after a failed write the files are opened again, however often that fails at first, and
//   nobody need ask for anything meanwhile.
// Method: a disk that is full and has room again; how often it was opened is counted.
#include "cli/service/disk_keeper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

class DiskKeeperTest : public testing::Test {
 protected:
  static CityOptions On(const std::shared_ptr<FaultFileSystem>& disk) {
    CityOptions options = City::Options(1);
    options.database.file_system = disk;
    return options;
  }
  void Await(int count) const {
    while (reopened_ < count) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }

  const std::shared_ptr<FaultFileSystem> disk_ = std::make_shared<FaultFileSystem>();
  City city_{On(disk_)};
  std::atomic<int> reopened_ = 0;
};

TEST_F(DiskKeeperTest, TriesUntilItWorks) {
  disk_->FailWrites(1, Fault::kNoSpace, FaultFileSystem::kForever);
  const Status failed = city_.engine().Submit(city_.Submit(Walk(1, 0.9, 5)[0])).status();
  ASSERT_EQ(failed.code(), StatusCode::kIoError);
  {
    DiskKeeper keeper(&city_.engine(), city_.path(), [this] { ++reopened_; });
    keeper.NoteFailure(failed);
    // The first attempt fails, and leaves the database closed.
    StatusCode code = StatusCode::kOk;
    while (code == StatusCode::kOk) code = city_.engine().Ask().Status().status().code();
    EXPECT_EQ(code, StatusCode::kBusy) << "it is to be asked again later";
    EXPECT_EQ(reopened_, 0);
    disk_->Heal();
    Await(1);
    EXPECT_OK(city_.engine().Ask().Status());
    EXPECT_OK(city_.engine().AddCamera("other", StreetCameraModel(), "the truth"));
    keeper.NoteFailure(failed);
    Await(2);
    keeper.Stop();
    keeper.NoteFailure(failed);
  }
  EXPECT_EQ(reopened_, 2);
}

// Whoever has closed them tells nobody.
TEST_F(DiskKeeperTest, FindsFilesThatCouldNotBeOpenedAgain) {
  DiskKeeper keeper(&city_.engine(), city_.path(), [this] { ++reopened_; });
  disk_->FailWrites(1, Fault::kNoSpace, FaultFileSystem::kForever);
  ASSERT_EQ(city_.engine().Reopen().code(), StatusCode::kIoError);
  disk_->Heal();
  keeper.Look();
  Await(1);
  EXPECT_OK(city_.engine().Ask().Status());
}

TEST_F(DiskKeeperTest, TouchesNothingForOtherReasons) {
  DiskKeeper keeper(&city_.engine(), city_.path(), [this] { ++reopened_; });
  const Questions before = city_.engine().Ask();
  for (const Status& other : {Status::Busy("later"), Status::NotFound("no"), Status::Ok()})
    keeper.NoteFailure(other);
  keeper.Look();
  keeper.Stop();
  EXPECT_EQ(reopened_, 0);
  EXPECT_OK(before.Status()) << "its files are open";
}

}  // namespace
}  // namespace veduta
