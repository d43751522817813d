// SPDX-License-Identifier: Apache-2.0
// Goal: others write while a copy is read; a removal meanwhile names the copy; of a database that
//   cannot be read there is no copy, nor where it is stopped, and the journal says so.
// Method: a file system that stops a copy where it opens the first table of the copy, until
//   another thread has written; a copy of damaged photos.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stop_token>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/storage/on_first_table.h"

namespace veduta {
namespace {

// Somewhere in the first value.
void FlipByte(const std::filesystem::path& path) {
  constexpr std::streamoff kOffset = 300;
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(kOffset);
  const int byte = file.get();
  ASSERT_TRUE(file) << path;
  file.seekp(kOffset);
  file.put(static_cast<char>(byte ^ 1));
}

std::vector<std::string> BackupEntries(const Snapshot& snapshot) {
  std::vector<std::string> entries;
  EXPECT_OK(snapshot.ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action.starts_with("backup")) entries.push_back(entry.action + " " + entry.detail);
    return true;
  }));
  return entries;
}

// With the turn held while the copy is read, each would wait for the other.
TEST(Copy, IsReadWhileOthersWrite) {
  const TemporaryFolder folder;
  const std::string copy = folder / "copy";
  City* writes = nullptr;
  std::vector<std::string> copies;
  CityOptions options = City::Options(2);
  options.database.file_system = std::make_shared<OnFirstTable>("/copy/", [&] {
    std::thread([&] {
      EXPECT_OK(writes->engine().AddCamera("late", StreetCameraModel(), "a test"));
      RemoveRequest request;
      request.photos = {"#1"};
      const auto removed = writes->engine().Remove(request);
      ASSERT_OK(removed);
      copies = removed->copies;
    }).join();
  });
  City city(options);
  writes = &city;
  city.Add({{6.0, 90}});
  ASSERT_OK(city.parts().database->Compact());
  ASSERT_OK(city.engine().Copy(copy));
  EXPECT_EQ(copies, std::vector<std::string>{copy});
  EXPECT_EQ(BackupEntries(city.Ask().snapshot()), std::vector<std::string>{"backup " + copy});
  EXPECT_OK(city.engine().Ask().Camera("late"));
  EngineOptions reading;
  reading.read_only = true;
  const auto opened = Engine::Open(copy, reading);
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->Ask().Camera("late").status().code(), StatusCode::kNotFound);
  EXPECT_OK((*opened)->Ask().Image("#1"));
}

// As the daemon stops one when it ends itself.
TEST(Copy, ThatIsStoppedIsDeleted) {
  const TemporaryFolder folder;
  const std::string copy = folder / "copy";
  std::stop_source stop;
  CityOptions options = City::Options(2);
  options.database.file_system =
      std::make_shared<OnFirstTable>("/copy/", [&] { stop.request_stop(); });
  City city(options);
  city.Add({{6.0, 90}});
  ASSERT_OK(city.parts().database->Compact());
  const Status stopped = city.engine().Copy(copy, stop.get_token());
  EXPECT_EQ(stopped.code(), StatusCode::kCancelled) << stopped.message();
  EXPECT_NE(stopped.message().find("deleted"), std::string::npos) << stopped.message();
  EXPECT_FALSE(std::filesystem::exists(copy));
  const std::vector<std::string> entries = {"backup " + copy, "backup-deleted " + copy};
  EXPECT_EQ(BackupEntries(city.Ask().snapshot()), entries);
  EXPECT_EQ(city.engine().Copy(copy, stop.get_token()).code(), StatusCode::kCancelled);
  EXPECT_FALSE(std::filesystem::exists(copy)) << "it does not begin";
  EXPECT_EQ(BackupEntries(city.Ask().snapshot()), entries);
}

TEST(Copy, OfADamagedDatabaseThereIsNone) {
  const TemporaryFolder folder;
  const std::string copy = folder / "copy";
  City city;
  city.Add({{6.0, 90}});
  ASSERT_OK(city.parts().database->Compact());
  city.Close();
  for (const auto& entry : std::filesystem::directory_iterator(city.path())) {
    if (entry.path().extension() == ".blob") FlipByte(entry.path());
  }
  city.Open();
  EXPECT_EQ(city.engine().Copy(copy).code(), StatusCode::kCorruption);
  EXPECT_FALSE(std::filesystem::exists(copy));
  EXPECT_EQ(BackupEntries(city.Ask().snapshot()),
            (std::vector<std::string>{"backup " + copy, "backup-deleted " + copy}));
  const auto removed = city.engine().Remove({});
  ASSERT_OK(removed);
  EXPECT_EQ(removed->copies, std::vector<std::string>());
}

}  // namespace
}  // namespace veduta
