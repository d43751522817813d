// SPDX-License-Identifier: Apache-2.0
// Goal: features that cannot be read do not end the adding of photos: a photo is placed without
//   their image, or is set aside with the reason where it needs it, and the others go on; the
//   answers and verify name the damage.
// Method: one image's features are overwritten behind the database's back; the walk goes on.
#include <gtest/gtest.h>

#include "storage/records/photo_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

TEST(DamagedNeighbor, KeepsNoPhotoFromBeingAdded) {
  const std::vector<Stand> stands = Walk(6, 0.9, 9);
  City city;
  city.Add(std::vector<Stand>(stands.begin(), stands.begin() + 6));
  const ImageRecord damaged = *city.Ask().FindImage(TakePhoto(stands[4]).name);
  city.Close();
  // With the photo, so that the features cannot be derived again.
  for (const Family family : {Family::kFeatures, Family::kPhotos}) {
    WithRocksdb(
        city.path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, HashKey(damaged.photo), "no features").ok());
        },
        family);
  }
  city.Open();
  std::vector<AddOutcome> outcomes;
  std::vector<PhotoSubmission> photos;
  for (size_t i = 6; i < stands.size(); ++i) photos.push_back(city.Submit(stands[i]));
  // A step that needs the damaged image is set aside, and its failure told.
  city.TryAdd(photos, &outcomes).IgnoreBecause("a step may need the damaged image");
  ASSERT_EQ(outcomes.size(), photos.size());
  size_t stored_count = 0;
  for (const AddOutcome& outcome : outcomes) {
    SCOPED_TRACE(outcome.name + ": " + outcome.detail + outcome.failure.message());
    if (!outcome.failure.ok()) {  // what surrounds the damaged image cannot be adjusted
      EXPECT_EQ(outcome.failure.code(), StatusCode::kCorruption);
      EXPECT_NE(outcome.failure.message().find("features"), std::string::npos);
      continue;
    }
    ++stored_count;
    EXPECT_TRUE(outcome.verdict == Verdict::kPlaced || outcome.verdict == Verdict::kFounded);
    ASSERT_EQ(outcome.damaged.size(), 1u);
    EXPECT_EQ(outcome.damaged.front().image, damaged.id);
    EXPECT_NE(outcome.damaged.front().what.find("features"), std::string::npos);
  }
  EXPECT_GE(stored_count, 2u);
  EXPECT_EQ(city.Counts().images, 6 + stored_count);
  const auto violations = FindViolations(city.Ask().snapshot(), 9);
  ASSERT_OK(violations);
  ASSERT_FALSE(violations->empty());
}

}  // namespace
}  // namespace veduta
