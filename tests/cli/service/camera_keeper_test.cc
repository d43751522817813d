// SPDX-License-Identifier: Apache-2.0
// Goal: a city begins with photos that are sent to its daemon and whose camera nobody names: they
//   wait for each other, and are placed once their camera is calibrated by all of them.
// Method: photos of a rendered street are taken in by the daemon's intake.
#include "cli/service/camera_keeper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

void Ignore(uint64_t, const std::string&, const Result<AddOutcome>&) {}

// Sends them without a camera, and waits until each of them waits for it.
void Send(City* city, PhotoIntake* intake, size_t count) {
  std::vector<Stand> stands = Walk(5, 0.8, static_cast<int>(count));
  for (size_t i = 1; i < stands.size(); i += 3) stands[i].yaw_deg += 20;
  for (const Stand& stand : stands) {
    const TakenPhoto& photo = TakePhoto(stand);
    const auto number = intake->Accept(&city->engine(), {{photo.name, "", photo.jpeg}, "", "anna"});
    EXPECT_TRUE(std::holds_alternative<uint64_t>(number));
  }
}

TEST(CameraKeeper, BeginsACityWhenItIsAsked) {
  PhotoIntake intake({}, Ignore);
  City city;
  CameraKeeper keeper(&city.engine(), &intake);
  Send(&city, &intake, 8);
  while (intake.counts().awaiting_camera < 8) std::this_thread::yield();
  const auto cameras = keeper.CalibrateNow({});
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_EQ(cameras->front().name, "photos of 512x384") << cameras->front().why_not;
  while (intake.counts().waiting > 0) std::this_thread::yield();
  EXPECT_GE(city.Counts().placed, 7u);
  const auto none = keeper.CalibrateNow({});
  ASSERT_OK(none);
  EXPECT_TRUE(none->empty());
}

TEST(CameraKeeper, BeginsACityByItselfOnceNoMorePhotosCome) {
  PhotoIntake intake({}, Ignore);
  City city;
  CameraKeeper keeper(&city.engine(), &intake);
  Send(&city, &intake, 8);
  while (city.Counts().placed < 7) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(city.Counts().cameras, 2u) << "the named one of the street, and theirs";
}

// Though no other photo comes.
TEST(CameraKeeper, TriesAgainWhereTheDiskWasFull) {
  const auto disk = std::make_shared<FaultFileSystem>();
  CityOptions options = City::Options(2);
  options.database.file_system = disk;
  PhotoIntake intake({}, Ignore);
  City city(options);
  std::atomic<int> failures = 0;
  CameraKeeper keeper(&city.engine(), &intake, [&](const Status& failure) {
    EXPECT_EQ(failure.code(), StatusCode::kIoError) << failure.message();
    disk->Heal();
    EXPECT_OK(city.engine().Reopen());
    ++failures;
  });
  Send(&city, &intake, 8);
  while (intake.counts().awaiting_camera < 8) std::this_thread::yield();
  disk->FailWrites(1, Fault::kNoSpace, FaultFileSystem::kForever);
  while (intake.counts().waiting > 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(failures, 1);
  EXPECT_GE(city.Counts().placed, 7u);
}

TEST(CameraKeeper, EndsWhileItWaits) {
  PhotoIntake intake({}, Ignore);
  City city;
  const CameraKeeper keeper(&city.engine(), &intake);
  Send(&city, &intake, 3);
}

}  // namespace
}  // namespace veduta
