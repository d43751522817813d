// SPDX-License-Identifier: Apache-2.0
// Goal: features that cannot be read do not end the adding of photos. They are derived from the
//   photo, and all comes out as without the damage, also a vocabulary. Where the photo is damaged
//   too, a photo is placed without their image, or is set aside with the reason where it needs it,
//   and the others go on; the answers and verify name the damage.
// Method: one image's features are overwritten behind the database's back; the walk goes on.
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "storage/records/photo_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

// Overwrites what is stored of the photo in these families, behind the database's back.
void Damage(City* city, const ContentHash& photo, std::initializer_list<Family> families) {
  city->Close();
  for (const Family family : families) {
    WithRocksdb(
        city->path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, HashKey(photo), "no features").ok());
        },
        family);
  }
  city->Open();
}

// All keys and values of a family.
std::vector<std::pair<std::string, std::string>> Stored(const City& city, Family family) {
  std::vector<std::pair<std::string, std::string>> stored;
  EXPECT_OK(city.Ask().snapshot().ScanStored(
      family, [&](std::string_view key, const Result<StoredBytes>& value) {
        EXPECT_OK(value);
        if (value.ok())
          stored.emplace_back(key, std::string(value->bytes().begin(), value->bytes().end()));
        return true;
      }));
  return stored;
}

// Adds the first part of the walk, then the rest; in between the fifth photo's features are
// damaged, and a vocabulary falls due with the eighth photo.
void AddWalk(City* city, const std::vector<Stand>& stands, bool is_damaged) {
  city->Add(std::vector<Stand>(stands.begin(), stands.begin() + 6));
  const ImageRecord image = *city->Ask().FindImage(TakePhoto(stands[4]).name);
  if (is_damaged) {
    Damage(city, image.photo, {Family::kFeatures});
    EXPECT_EQ(city->Ask().snapshot().GetFeatures(image.photo).status().code(),
              StatusCode::kCorruption);
  } else {
    city->Reopen();
  }
  for (const AddOutcome& outcome :
       city->Add(std::vector<Stand>(stands.begin() + 6, stands.end()))) {
    EXPECT_EQ(outcome.verdict, Verdict::kPlaced) << outcome.detail;
    EXPECT_TRUE(outcome.damaged.empty());
  }
}

TEST(DamagedNeighbor, IsDerivedFromItsPhoto) {
  const std::vector<Stand> stands = Walk(6, 0.9, 9);
  CityOptions options = City::Options(2);
  options.ingest.retrieval.compare_all_max = 8;
  options.ingest.retrieval.training_count_max = 2000;
  City whole(options), damaged(options);
  AddWalk(&whole, stands, false);
  AddWalk(&damaged, stands, true);
  for (const Family family :
       {Family::kPoses, Family::kPoints, Family::kObservations, Family::kPairs, Family::kWords}) {
    const auto expected = Stored(whole, family);
    EXPECT_FALSE(expected.empty());
    EXPECT_TRUE(Stored(damaged, family) == expected) << static_cast<int>(family);
  }
  EXPECT_EQ(damaged.Counts().vocabulary_generation, 1u);
  EXPECT_EQ(whole.Counts().vocabulary_generation, 1u);
}

// Where the photo is damaged, too, only `veduta repair` helps those that lie around it.
TEST(DamagedNeighbor, FailsOnlyThoseThatNeedIt) {
  City city;
  city.Add(Walk(6, 0.9, 6));
  const ImageRecord damaged = *city.Ask().FindImage(TakePhoto(Walk(6, 0.9, 6)[4]).name);
  Damage(&city, damaged.photo, {Family::kFeatures, Family::kPhotos});
  std::vector<PhotoSubmission> photos;
  for (const Stand& beside : Walk(11.4, 0.9, 2)) photos.push_back(city.Submit(beside));
  for (const Stand& elsewhere : Walk(24, 0.9, 4)) photos.push_back(city.Submit(elsewhere));
  std::vector<AddOutcome> outcomes;
  // A step that needs the damaged image is set aside, and its failure told.
  city.TryAdd(photos, &outcomes).IgnoreBecause("a step may need the damaged image");
  ASSERT_EQ(outcomes.size(), photos.size());
  for (size_t i = 0; i < outcomes.size(); ++i) {
    const AddOutcome& outcome = outcomes[i];
    SCOPED_TRACE(outcome.name + ": " + outcome.detail + outcome.failure.message());
    EXPECT_EQ(outcome.id.valid(), outcome.failure.ok());
    if (i >= 2) {
      EXPECT_OK(outcome.failure);
      ASSERT_EQ(outcome.damaged.size(), 1u);
      EXPECT_EQ(outcome.damaged.front().image, damaged.id);
      EXPECT_NE(outcome.damaged.front().what.find("features"), std::string::npos);
    } else if (!outcome.failure.ok()) {
      EXPECT_EQ(outcome.failure.code(), StatusCode::kCorruption);
      EXPECT_NE(outcome.failure.message().find("features"), std::string::npos);
    }
  }
  EXPECT_NE(outcomes.back().verdict, Verdict::kPostponed) << "another place of the city goes on";
  const auto violations = FindViolations(city.Ask().snapshot(), 9);
  ASSERT_OK(violations);
  ASSERT_FALSE(violations->empty());
}

}  // namespace
}  // namespace veduta
