// SPDX-License-Identifier: Apache-2.0
// Goal: a repair keeps the submaps of a large reconstruction (HealSubmaps), without images that
//   lost their poses; where the submaps themselves are damaged or miss images, it leaves them out
//   and ends with a sound database, whose reconstruction is parted anew when it has next grown.
// Method: a street whose reconstruction is parted by bounds small enough for eight photos; records
//   of its files are overwritten, and the whole repair is run.
#include "storage/records/submap_record.h"

#include "engine/repair/healing.h"
#include "storage/records/image_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

constexpr ReconstructionId kStreet(1);
constexpr int kPhotos = 8;

// Parts of four images at most in reconstructions of more than six.
CityOptions SmallParts() {
  CityOptions options = City::Options(2);
  options.ingest.schedule.whole_images_max = 6;
  options.ingest.schedule.submap_images_max = 4;
  options.ingest.schedule.submap_images_min = 1;
  options.ingest.schedule.views_step = 2;
  options.ingest.schedule.submap_views_step = 2;
  options.ingest.schedule.region_images_max = 4;
  options.ingest.schedule.whole_again_images_max = 0;
  return options;
}

std::vector<Stand> Photos(int count) {
  return Walk(4, 1.2, count);
}

std::vector<SubmapRecord> SubmapsOf(const City& city) {
  const auto all = city.Ask().snapshot().ListSubmaps();
  EXPECT_OK(all);
  return all.ok() ? *all : std::vector<SubmapRecord>();
}

std::vector<ImageId> ImagesOf(const std::vector<SubmapRecord>& submaps) {
  std::vector<ImageId> images;
  for (const SubmapRecord& submap : submaps) {
    EXPECT_EQ(submap.reconstruction, kStreet);
    images.insert(images.end(), submap.images.begin(), submap.images.end());
  }
  std::ranges::sort(images);
  return images;
}

std::vector<ImageId> PlacedIn(const City& city) {
  std::vector<ImageId> placed;
  EXPECT_OK(city.Ask().snapshot().ScanPoses([&](const PoseRecord& pose) {
    placed.push_back(pose.image);
    return true;
  }));
  return placed;
}

// A city of one reconstruction in several submaps.
class SubmapHealing : public testing::Test {
 protected:
  SubmapHealing() : city_(SmallParts()) {
    city_.Add(Photos(kPhotos));
    EXPECT_OK(city_.engine().Settle());
    before_ = SubmapsOf(city_);
    EXPECT_GE(before_.size(), 2u) << "it is not parted";
    EXPECT_EQ(PlacedIn(city_).size(), size_t{kPhotos});
  }

  void Overwrite(Family family, const std::string& key, const std::string& value) {
    city_.Close();
    WithRocksdb(
        city_.path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, key, value).ok());
        },
        family);
  }
  RepairAnswer Repair() {
    const auto answer = Engine::Repair(city_.path(), {.apply = true, .thread_count = 2});
    EXPECT_OK(answer);
    if (!answer.ok()) return {};
    EXPECT_TRUE(answer->is_repaired);
    EXPECT_FALSE(answer->is_rebuilt);
    city_.Reopen();
    EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
    EXPECT_EQ(PlacedIn(city_).size(), size_t{kPhotos});
    return *answer;
  }
  void ExpectPartedWhenItHasGrown() {
    EXPECT_TRUE(SubmapsOf(city_).empty());
    city_.Add(Photos(kPhotos + 2));  // two are new
    ASSERT_OK(city_.engine().Settle());
    EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
    EXPECT_GE(SubmapsOf(city_).size(), 2u);
    EXPECT_EQ(ImagesOf(SubmapsOf(city_)), PlacedIn(city_));
  }

  City city_;
  std::vector<SubmapRecord> before_;
};

TEST_F(SubmapHealing, KeepsThemWhereSomethingElseIsDamaged) {
  const ImageId lost = before_.front().images.front();
  Overwrite(Family::kPoses, ImageKey(lost), "garbage");
  const RepairAnswer answer = Repair();
  EXPECT_EQ(answer.retried.size(), 1u);
  ASSERT_FALSE(SubmapsOf(city_).empty());
  EXPECT_EQ(ImagesOf(SubmapsOf(city_)), PlacedIn(city_)) << "it got its pose and its submap back";
}

TEST_F(SubmapHealing, LeavesOutWhatCannotBeRead) {
  Overwrite(Family::kMeta, SubmapKey(before_.front().id), "garbage");
  const RepairAnswer answer = Repair();
  ASSERT_EQ(answer.findings.size(), 1u);
  EXPECT_TRUE(answer.findings[0].damage.starts_with("the submaps cannot be read"));
  ExpectPartedWhenItHasGrown();
}

TEST_F(SubmapHealing, LeavesOutThoseThatMissAnImage) {
  SubmapRecord short_of_one = before_.front();
  short_of_one.images.pop_back();
  short_of_one.images_at_adjustment = static_cast<uint32_t>(short_of_one.images.size());
  Overwrite(Family::kMeta, SubmapKey(short_of_one.id), *Encode(short_of_one));
  const RepairAnswer answer = Repair();
  bool is_told = false;
  for (const RepairFinding& finding : answer.findings)
    is_told =
        is_told || finding.damage == "the submaps of reconstruction 1 do not have all its images";
  EXPECT_TRUE(is_told);
  ExpectPartedWhenItHasGrown();
}

}  // namespace
}  // namespace veduta
