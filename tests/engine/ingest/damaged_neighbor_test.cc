// SPDX-License-Identifier: Apache-2.0
// Goal: features that cannot be read keep no later photo from being added: photos are placed
//   without their image, and the answer and verify name the damage.
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
  WithRocksdb(
      city.path(),
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* family) {
        ASSERT_TRUE(db.Put({}, family, HashKey(damaged.photo), "no features").ok());
      },
      Family::kFeatures);
  city.Open();
  std::vector<AddOutcome> outcomes;
  std::vector<PhotoSubmission> photos;
  for (size_t i = 6; i < stands.size(); ++i) photos.push_back(city.Submit(stands[i]));
  // A step that needs the damaged image is set aside, and its failure told.
  city.TryAdd(photos, &outcomes).IgnoreBecause("a step may need the damaged image");
  ASSERT_EQ(outcomes.size(), photos.size());
  for (const AddOutcome& outcome : outcomes) {
    SCOPED_TRACE(outcome.name + ": " + outcome.detail);
    EXPECT_OK(outcome.failure);
    EXPECT_TRUE(outcome.verdict == Verdict::kPlaced || outcome.verdict == Verdict::kFounded);
    ASSERT_EQ(outcome.damaged.size(), 1u);
    EXPECT_EQ(outcome.damaged.front().image, damaged.id);
    EXPECT_NE(outcome.damaged.front().what.find("features"), std::string::npos);
  }
  EXPECT_EQ(city.Counts().images, stands.size());
  const auto violations = FindViolations(city.Ask().snapshot(), 9);
  ASSERT_OK(violations);
  ASSERT_FALSE(violations->empty());
  EXPECT_NE(violations->front().find("features"), std::string::npos) << violations->front();
}

}  // namespace
}  // namespace veduta
