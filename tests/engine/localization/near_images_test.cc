// SPDX-License-Identifier: Apache-2.0
// Goal: what is near a stored photo is found by what it shares with others, and what is near a
//   place on the earth by where images stand; a dozen at most, the nearest first.
// Method: a synthetic scene in a database, whose reconstruction is put on the earth by hand.
#include "engine/localization/near_images.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/earth/local_frame.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(ImagesNear, APhotoAndWhatItSharesMostWith) {
  SceneDatabase scene({.camera_count = 16});
  scene.AddImages(0, 16);
  scene.AddReconstruction({0, 1, 2, 3});
  const auto near = ImagesNear(*scene.Snap(), "#3");
  ASSERT_OK(near);
  ASSERT_EQ(near->size(), 12u);
  EXPECT_EQ(near->front(), ImageId(3));
  uint32_t before = std::numeric_limits<uint32_t>::max();
  for (size_t i = 1; i < near->size(); ++i) {
    const auto pair = scene.Snap()->GetPair(ImageId(3), (*near)[i]);
    ASSERT_OK(pair);
    EXPECT_LE(pair->matches.size(), before);
    before = static_cast<uint32_t>(pair->matches.size());
  }
  EXPECT_EQ(ImagesNear(*scene.Snap(), "nobody").status().code(), StatusCode::kNotFound);
}

TEST(ImagesNear, APlaceAndWhoStandsThere) {
  SceneDatabase scene({.camera_count = 14});
  scene.AddImages(0, 14);
  const ReconstructionId id =
      scene.AddReconstruction({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13});
  const GeoPosition origin{47.07, 15.44, 350};
  EXPECT_TRUE(ImagesNear(*scene.Snap(), origin)->empty()) << "nobody knows where it is";
  ReconstructionRecord record = *scene.Snap()->GetReconstruction(id);
  EarthPlace& place = record.georeference.place.emplace();
  place.origin = origin;
  place.enu_from_world.scale = 10;
  record.georeference.version = 1;
  const auto transaction = scene.database()->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  const LocalFrame frame(origin);
  for (const uint32_t k : {0u, 6u, 13u}) {
    GeoPosition there = frame.ToGeo(place.enu_from_world * scene.scene().poses[k].Center());
    there.height_m += 40;  // which nobody asks about
    const auto near = ImagesNear(*scene.Snap(), there);
    ASSERT_OK(near);
    ASSERT_EQ(near->size(), 12u);
    EXPECT_EQ(near->front(), ImageId(k + 1));
  }
}

}  // namespace
}  // namespace veduta
