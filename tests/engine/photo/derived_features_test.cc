// SPDX-License-Identifier: Apache-2.0
// Goal: the features of a stored photo come out the same whether they are read or computed again,
//   and are not made up where the photo is damaged too.
// Method: a photo of the street is stored; its stored features, then its bytes, are overwritten.
#include "engine/photo/derived_features.h"

#include <gtest/gtest.h>

#include "engine/photo/carried_features.h"
#include "engine/photo/photo_preparer.h"
#include "storage/records/photo_record.h"
#include "tests/engine/street_photos.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

// Of a lens that was refined since, they are extracted by the one that it was.
void ExpectCarried(const Snapshot& snapshot, const ImageRecord& image, const CameraRecord& camera,
                   Features features, UndistortCache* tables) {
  CameraRecord refined = camera;
  refined.refined_from = camera.model;
  refined.model.k1 += 0.05;
  const auto carried = ReadOrDeriveFeatures(snapshot, image, refined, tables);
  ASSERT_OK(carried);
  EXPECT_EQ(carried->descriptors, features.descriptors);
  EXPECT_NE(carried->keypoints, features.keypoints);
  CarryKeypoints(refined, features.keypoints);
  EXPECT_EQ(carried->keypoints, features.keypoints);
}

TEST(DerivedFeatures, AreTheStoredOnes) {
  const TemporaryFolder folder;
  const std::string path = folder / "db";
  const TakenPhoto& photo = TakePhoto({4, 90});
  const CameraRecord camera{CameraId(1), "street", StreetCameraModel(), "rendered"};
  UndistortCache tables(1 << 20);
  ImageRecord image;
  Features features;
  {
    DatabaseOptions options;
    options.create = true;
    const auto database = Database::Open(path, options);
    ASSERT_OK(database);
    const PhotoPreparer preparer(database->get(), &tables, PrepareOptions());
    const PreparedPhoto prepared = preparer.Extract({photo.name, "", photo.jpeg}, camera.model);
    ASSERT_EQ(prepared.reason, Reason::kNone) << prepared.detail;
    image.name = photo.name;
    image.photo = prepared.hash;
    image.feature_count = static_cast<uint32_t>(prepared.features.size());
    features = prepared.features;
    ASSERT_OK((*database)->WritePhotoAhead(image.photo, photo.jpeg, features));
    const auto read = ReadOrDeriveFeatures(*(*database)->GetSnapshot(), image, camera, &tables);
    ASSERT_OK(read);
    EXPECT_EQ(read->keypoints, features.keypoints);
  }
  const auto overwrite = [&](Family family) {
    WithRocksdb(
        path,
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, HashKey(image.photo), "damaged").ok());
        },
        family);
  };
  DatabaseOptions reading;
  reading.read_only = true;
  overwrite(Family::kFeatures);
  {
    const auto database = Database::Open(path, reading);
    ASSERT_OK(database);
    const auto derived = ReadOrDeriveFeatures(*(*database)->GetSnapshot(), image, camera, &tables);
    ASSERT_OK(derived);
    EXPECT_EQ(derived->keypoints, features.keypoints);
    EXPECT_EQ(derived->descriptors, features.descriptors);
    ExpectCarried(*(*database)->GetSnapshot(), image, camera, features, &tables);
  }
  overwrite(Family::kPhotos);
  const auto database = Database::Open(path, reading);
  ASSERT_OK(database);
  EXPECT_EQ(
      ReadOrDeriveFeatures(*(*database)->GetSnapshot(), image, camera, &tables).status().code(),
      StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
