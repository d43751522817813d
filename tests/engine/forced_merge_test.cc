// SPDX-License-Identifier: Apache-2.0
// Goal: a wrong merge that was believed once is found and mended by what comes after it: it is
//   split, and both sides are as accurate as before, or one side is moved to where it belongs.
// Method: castle-P19 of Strecha's benchmark, whose facades repeat, with the truth; a merge by a
//   similarity of the test's own, and a merge that the engine makes where every doubt is off.
//   Skipped where the photos are not.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>

#include "engine/ingest/map_loader.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/write_scope.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

std::filesystem::path Folder() {
  return std::filesystem::path(VEDUTA_TEST_DATA) / "strecha" / "castle-P19";
}

std::string NameOf(uint32_t number) {
  char name[16];
  std::snprintf(name, sizeof(name), "%04u.jpg", number);
  return name;
}

CameraModel CastleCamera() {
  CameraModel model;
  model.width_px = 1536;
  model.height_px = 1024;
  model.fx = 1379.74;
  model.fy = 1382.08;
  model.cx = model.u0 = 760.095;
  model.cy = model.v0 = 503.155;
  return model;
}

// The benchmark's file: K, three zeros, the rotation from camera to world, the centre.
Rigid3 TruthOf(uint32_t number) {
  std::ifstream file(Folder() / "truth" / (NameOf(number) + ".camera"));
  const std::vector<double> values{std::istream_iterator<double>(file), {}};
  EXPECT_EQ(values.size(), 26u) << NameOf(number);
  Eigen::Matrix3d world_from_cam;
  for (int i = 0; i < 9; ++i) world_from_cam(i / 3, i % 3) = values[static_cast<size_t>(12 + i)];
  const Eigen::Vector3d center(values[21], values[22], values[23]);
  Rigid3 pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose()));
  pose.translation = -(pose.rotation * center);
  return pose;
}

struct Castle {
  City city;

  explicit Castle(CityOptions options) : city(std::move(options)) {
    EXPECT_OK(city.engine().AddCamera("castle", CastleCamera(), "the benchmark"));
  }

  std::string Add(const std::vector<uint32_t>& numbers) {
    std::vector<PhotoSubmission> photos;
    for (const uint32_t number : numbers) {
      std::ifstream file(Folder() / NameOf(number), std::ios::binary);
      std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
      photos.push_back({{NameOf(number), NameOf(number), std::move(bytes)}, "castle", "anna"});
    }
    const std::string told = Told(city.Add(photos));
    EXPECT_OK(city.engine().Settle());
    return told;
  }

  std::map<ReconstructionId, PoseErrors> Errors() const {
    const CityQuestions ask = city.Ask();
    std::map<ReconstructionId, std::pair<std::vector<Rigid3>, std::vector<Rigid3>>> poses;
    for (uint32_t number = 0; number < 19; ++number) {
      const auto id = ask.snapshot().FindImageByName(NameOf(number), "anna");
      if (!id.ok() || !*id) continue;
      const auto pose = ask.snapshot().FindPose(**id);
      if (!pose.ok() || !*pose) continue;
      poses[(*pose)->reconstruction].first.push_back((*pose)->cam_from_world);
      poses[(*pose)->reconstruction].second.push_back(TruthOf(number));
    }
    std::map<ReconstructionId, PoseErrors> errors;
    for (const auto& [id, both] : poses) errors[id] = ComparePoses(both.first, both.second);
    return errors;
  }
};

// As if a photo had led to the merge and everything had spoken for it.
void ForceMerge(const City& city, ReconstructionId into, ReconstructionId from,
                const Sim3& into_from) {
  EngineParts& parts = city.parts();
  const Writer::Turn turn = parts.writer->Take();
  const WriteScope scope = BeginWrite(parts.database.get());
  CityMap map;
  const std::shared_ptr<EngineCaches> caches = parts.GetCaches();
  MapLoader loader(scope.base, &caches->features, &map);
  std::vector<ImageId> kept, moved;
  ASSERT_OK(loader.LoadReconstruction(into, &kept));
  ASSERT_OK(loader.LoadReconstruction(from, &moved));
  for (const ImageId id : moved) {
    map.MoveImage(id, into, into_from);
    map.MoveBlock(id, into, into_from);
  }
  Placement placement;
  placement.verdict = Verdict::kMerged;
  placement.reconstruction = into;
  placement.merges = {{from, into_from, 0, "forced by a test"}};
  auto state = scope.base->GetState();
  ASSERT_OK(state);
  ASSERT_OK(WritePlacement(map, *scope.base, placement, {}, &*state, scope.transaction.get()));
  scope.transaction->PutState(*state);
  ASSERT_OK(scope.transaction->Commit());
  parts.RenewCaches();
}

// Everything that is doubted about a merge or a reconstruction, off.
void BelieveAll(DoubtOptions* doubt) {
  doubt->seam_pairs_min = 1;
  doubt->seam_jackknife_share_max = 1e9;
  doubt->seam_contradiction_share_max = 1e9;
  doubt->seam_confirmed_contradiction_share_max = 1e9;
  doubt->seam_missing_share_max = 1;
  doubt->seam_view_missing_share_max = 1;
  doubt->missing_share_max = 1;
  doubt->parts.contradiction_share_max = 1e9;
  doubt->beside_missing_share_max = 1;
  doubt->raising_contradiction_share_min = 1e9;
  doubt->images_between_min = 1000;
}

// Within the limits of veduta-bench-orders: half a metre and 2 degrees.
void ExpectRight(const Castle& castle, size_t placed_min) {
  size_t placed = 0;
  for (const auto& [id, errors] : castle.Errors()) {
    SCOPED_TRACE("reconstruction " + std::to_string(id.value));
    placed += errors.count;
    EXPECT_LT(errors.center_m_max, 0.5);
    EXPECT_LT(errors.angle_deg_max, 2);
  }
  EXPECT_GE(placed, placed_min);
  EXPECT_TRUE(IsSound(castle.city.Ask().snapshot()));
}

bool WasSplit(const Castle& castle) {
  bool was_split = false;
  EXPECT_OK(castle.city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
    was_split |= entry.action == "split";
    return true;
  }));
  return was_split;
}

TEST(ForcedMerge, IsSplitAndBothSidesAreAsTheyWere) {
  if (!std::filesystem::exists(Folder())) GTEST_SKIP() << Folder() << " is not there";
  Castle castle(City::Options(2));
  castle.Add({0, 1, 2, 3, 4});
  castle.Add({11, 12, 13, 14, 15});
  const auto before = castle.Errors();
  ASSERT_EQ(before.size(), 2u);
  const ReconstructionId a = before.begin()->first, b = before.rbegin()->first;
  // Both begin in the frame of a first camera, so their first cameras come to stand in one place.
  ForceMerge(castle.city, a, b, {});
  const auto merged = castle.Errors();
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_GT(merged.begin()->second.center_m_max, 5) << "the merge is wrong";
  ASSERT_OK(castle.city.engine().Settle());
  const auto after = castle.Errors();
  ASSERT_EQ(after.size(), 2u);
  auto side = after.begin();
  for (const auto& [id, errors] : before) {
    EXPECT_EQ(side->second.count, errors.count);
    EXPECT_LT(side->second.center_m_max, errors.center_m_max + 0.02);
    ++side;
  }
  EXPECT_TRUE(WasSplit(castle));
  castle.Add({5, 6, 7, 8, 9, 10, 16, 17, 18});
  ExpectRight(castle, 18);
}

// The two sides of the courtyard are merged by one photo that sees both, at a wrong scale. What
// comes then moves one side to where it belongs (better_body.h), or splits it off.
TEST(ForcedMerge, ThatManyPhotosAgreedWithIsMendedByWhatComesThen) {
  if (!std::filesystem::exists(Folder())) GTEST_SKIP() << Folder() << " is not there";
  CityOptions options = City::Options(2);
  const IngestOptions usual = options.ingest;
  BelieveAll(&options.ingest.mapper.doubt);
  Castle castle(options);
  castle.Add({11, 3, 16, 13, 5, 2, 14, 8, 12, 1, 0, 7});
  const auto merged = castle.Errors();
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_EQ(merged.begin()->second.count, 12u);
  EXPECT_GT(merged.begin()->second.center_m_max, 5) << "the merge is wrong";
  castle.city.Reopen(usual);
  castle.Add({10, 6, 17, 4, 15, 9, 18});
  ExpectRight(castle, 18);
}

}  // namespace
}  // namespace veduta
