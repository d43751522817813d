// SPDX-License-Identifier: Apache-2.0
// Goal: whichever write fails while a database of an older format is opened for writing, nothing of
//   the city is lost, and the next opening finishes what was begun.
// Method: the fixtures that the binaries of their time wrote (make_fixture.sh), opened again and
//   again with the n-th write operation and all later ones failing, for every n until none fails.
//   Then the process "crashes" (reopen), or the power is cut (unsynced data dropped, then reopen).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "storage/database.h"
#include "tests/storage/fault_file_system.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

// So that the loop ends. Opening format 1 makes 103 write operations, format 2 makes 99 (counted by
// this test on 2026-11-22).
constexpr uint64_t kWritesMax = 1000;

void Unpack(const std::string& fixture, const std::string& folder) {
  const std::string command =
      "tar -xzf '" VEDUTA_FORMATS "/" + fixture + ".tar.gz' -C '" + folder + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

void Copy(const std::string& from, const std::string& to) {
  std::filesystem::remove_all(to);
  std::filesystem::copy(from, to, std::filesystem::copy_options::recursive);
}

// All that the families hold, in a text that two databases can be compared by. What an `add` wrote
// ahead before it was killed (photo 0020) must not be in it.
std::string ContentOf(const Database& database) {
  const auto snapshot = database.GetSnapshot();
  std::ostringstream text;
  const auto state = snapshot->GetState();
  EXPECT_OK(state);
  text << state->next_image << ' ' << state->next_reconstruction << ' ' << state->next_journal
       << ' ' << state->vocabulary_generation << '\n';
  const auto named = snapshot->FindImageByName("photo0019.jpg", "anna");
  EXPECT_OK(named);
  EXPECT_TRUE(named.ok() && named->has_value());
  const auto cameras = snapshot->ListCameras();
  EXPECT_OK(cameras);
  for (const CameraRecord& camera : *cameras) text << camera.name << ' ' << camera.model.fx << '\n';
  EXPECT_OK(snapshot->ScanImages([&](const ImageRecord& image) {
    text << image.id.value << ' ' << image.name << ' ' << static_cast<int>(image.verdict) << ' '
         << image.detail << '\n';
    if (image.verdict == Verdict::kRejected) return true;
    EXPECT_OK(snapshot->GetPhoto(image.photo));
    text << snapshot->GetFeatures(image.photo)->size() << " features, "
         << snapshot->ListNeighbors(image.id)->size() << " neighbours, "
         << snapshot->GetObservations(image.id)->size() << " observations\n";
    return true;
  }));
  EXPECT_OK(snapshot->ScanPoses([&](const PoseRecord& pose) {
    text << pose.image.value << ' ' << pose.cam_from_world.translation.transpose() << '\n';
    return true;
  }));
  const auto reconstructions = snapshot->ListReconstructions();
  EXPECT_OK(reconstructions);
  for (const ReconstructionRecord& record : *reconstructions) {
    EXPECT_OK(snapshot->ScanPointBlocks(
        record.id, record.points_generation, [&](const PointBlock& block) {
          for (const PointRecord& point : block.points)
            text << block.home.value << ' ' << point.position.transpose() << '\n';
          return true;
        }));
  }
  uint32_t journal_count = 0, photo_count = 0, dense_count = 0;
  EXPECT_OK(snapshot->ScanJournal(0, [&](const JournalRecord&) { return ++journal_count, true; }));
  EXPECT_OK(snapshot->ScanPhotoKeys([&](const ContentHash&) { return ++photo_count, true; }));
  EXPECT_OK(snapshot->dense().ScanAll([&](uint8_t, auto, auto) { ++dense_count; }));
  text << journal_count << " journal, " << photo_count << " photos, " << dense_count << " dense\n";
  return text.str();
}

class Upgrade : public testing::TestWithParam<std::tuple<std::string, bool>> {};

TEST_P(Upgrade, SurvivesEveryFailedWrite) {
  const auto& [fixture, power_cut] = GetParam();
  const TemporaryFolder folder;
  Unpack(fixture, folder.path());
  const std::string city = folder / "city", tried = folder / "tried";
  Copy(city, tried);
  auto opened = Database::Open(tried, {});
  ASSERT_OK(opened);
  const std::string expected = ContentOf(**opened);
  opened->reset();
  EXPECT_NE(expected.find("photo0019.jpg"), std::string::npos) << expected;
  EXPECT_NE(expected.find("5 photos"), std::string::npos) << "the sixth was written ahead only";

  uint64_t n = 1, refused = 0;
  for (bool failed = true; failed; ++n) {
    ASSERT_LT(n, kWritesMax);
    Copy(city, tried);
    const auto file_system = std::make_shared<FaultFileSystem>();
    file_system->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    opened = Database::Open(tried, {.file_system = file_system});
    refused += !opened.ok();
    if (opened.ok()) opened->reset();
    failed = file_system->fault_count() > 0;
    if (power_cut) {
      file_system->DropUnsyncedData();
    } else {
      file_system->Heal();
    }
    opened = Database::Open(tried, {.file_system = file_system});
    ASSERT_TRUE(IsOk(opened)) << "after write " << n << " had failed";
    ASSERT_EQ(ContentOf(**opened), expected) << "after write " << n << " had failed";
    opened->reset();
    const auto reader = Database::Open(tried, {.read_only = true});
    ASSERT_TRUE(IsOk(reader)) << "after write " << n << " had failed";
    ASSERT_EQ(ContentOf(**reader), expected);
  }
  // So that the loop has really gone through the opening.
  EXPECT_GT(refused, 5u);
}

INSTANTIATE_TEST_SUITE_P(
    Formats, Upgrade,
    testing::Combine(testing::Values(std::string("format1"), std::string("format2"),
                                     std::string("format3"), std::string("format4"),
                                     std::string("format5"), std::string("format6")),
                     testing::Bool()),
    [](const auto& info) {
      return std::get<0>(info.param) + (std::get<1>(info.param) ? "_power_cut" : "_crash");
    });

}  // namespace
}  // namespace veduta
