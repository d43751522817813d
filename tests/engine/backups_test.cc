// SPDX-License-Identifier: Apache-2.0
// Goal: photos come while a backup is made, and it has the commit at which it began; one that is
//   stopped goes on from what it has copied; what a killed one has left goes when the database is
//   opened.
// Method: a file system that stops a backup where it opens the first table of the links, until
//   another thread has written; a stop from there.
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/storage/on_first_table.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

// While the links are opened, `act` runs on a thread of its own.
CityOptions ActingMeanwhile(std::function<void()> act) {
  CityOptions options = City::Options(2);
  options.database.file_system = std::make_shared<OnFirstTable>(
      std::string("/") + kBackupLinks + "/", [act] { std::thread(act).join(); });
  return options;
}

TEST(Backups, AreMadeWhileOthersWrite) {
  const TemporaryFolder folder;
  City* writes = nullptr;
  Status beside;
  City city(ActingMeanwhile([&] {
    EXPECT_OK(writes->engine().AddCamera("late", StreetCameraModel(), "a test"));
    beside = writes->engine().Backup({folder / "others", 0}).status();
  }));
  writes = &city;
  city.Add({{6.0, 90}});
  ASSERT_OK(city.parts().database->Compact());
  const auto made = city.engine().Backup({folder / "backups", 0});
  ASSERT_OK(made);
  EXPECT_EQ(beside.code(), StatusCode::kBusy);
  EXPECT_EQ(made->copied_files, made->backup.files);
  EXPECT_FALSE(fs::exists(city.path() + "/" + kBackupLinks));
  const auto restored = RestoreBackup(folder / "backups", 0, folder / "restored");
  ASSERT_OK(restored);
  EXPECT_EQ(restored->number, 1u);
  EngineOptions reading;
  reading.read_only = true;
  const auto opened = Engine::Open(folder / "restored", reading);
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->Ask().Camera("late").status().code(), StatusCode::kNotFound);
  EXPECT_OK((*opened)->Ask().Image("#1"));
}

TEST(Backups, OneThatIsStoppedIsNone) {
  const TemporaryFolder folder;
  std::stop_source stop;
  City city(ActingMeanwhile([&] { stop.request_stop(); }));
  city.Add({{6.0, 90}});
  ASSERT_OK(city.parts().database->Compact());
  const BackupRequest request{folder / "backups", 0};
  EXPECT_EQ(city.engine().Backup(request, stop.get_token()).status().code(),
            StatusCode::kCancelled);
  const auto none = ListBackups(request.folder);
  ASSERT_OK(none);
  EXPECT_TRUE(none->backups.empty() && none->damage.empty());
  EXPECT_EQ(RestoreBackup(request.folder, 0, folder / "never").status().code(),
            StatusCode::kNotFound);
  EXPECT_OK(city.engine().Backup(request));
  const auto checked = CheckBackups(request.folder);
  ASSERT_OK(checked);
  EXPECT_EQ(checked->backups.size(), 1u);
  EXPECT_EQ(ThinBackups(request.folder, 0).status().code(), StatusCode::kInvalidArgument);
}

TEST(Backups, WhatAKilledOneLeftGoes) {
  City city;
  const fs::path links = city.path() + "/" + kBackupLinks;
  city.Close();
  fs::create_directory(links);
  fs::create_hard_link(city.path() + "/CURRENT", links / "CURRENT");
  city.Open();
  EXPECT_FALSE(fs::exists(links));
}

}  // namespace
}  // namespace veduta
