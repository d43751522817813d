// SPDX-License-Identifier: Apache-2.0
// Goal: a camera comes back as it was stored; one that breaks a rule is not encoded, and a damaged
//   value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/camera_record.h"

#include <gtest/gtest.h>

#include "storage/model/awaited_photos.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

ContentHash HashOf(std::string_view text) {
  return HashContent({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

TEST(CameraRecord, RoundTrips) {
  CameraRecord camera{CameraId(kMax),
                      "Nikon \xFF\xC3 not UTF-8",
                      {1, 2, 3.5, 4, 5, 6, -7, 8, 9, -0.0},
                      std::string("a\0b", 3)};
  camera.is_refinable = true;
  camera.told_focal_share = 0.75;
  camera.focal_stddev_share = 0.01;
  camera.version = 7;
  camera.refined_from = camera.model;
  camera.refined_from->fx = 3.25, camera.refined_from->fy = 3.75;
  camera.refined_from->k1 = 0.125, camera.refined_from->k2 = -1;
  const AwaitedPhotos awaited{{HashOf("one"), HashOf("other")}, HashOf("list")};
  camera.awaited = std::make_shared<const AwaitedPhotos>(awaited);
  CameraRecord decoded;
  RoundTrip(camera, &decoded, camera.id);
  EXPECT_EQ(decoded.id, camera.id);
  EXPECT_EQ(decoded.name, camera.name);
  EXPECT_EQ(decoded.source, camera.source);
  EXPECT_EQ(decoded.model, camera.model);
  EXPECT_TRUE(decoded.is_refinable);
  EXPECT_EQ(decoded.told_focal_share, camera.told_focal_share);
  EXPECT_EQ(decoded.focal_stddev_share, camera.focal_stddev_share);
  EXPECT_EQ(decoded.version, 7u);
  EXPECT_EQ(decoded.refined_from, camera.refined_from);
  EXPECT_EQ(decoded.extraction_model(), *camera.refined_from);
  ASSERT_NE(decoded.awaited, nullptr);
  EXPECT_EQ(decoded.awaited->photos, awaited.photos);
  EXPECT_EQ(decoded.awaited->list, awaited.list);
  CameraRecord empty;
  empty.id = CameraId(1);
  RoundTrip(empty, &decoded, empty.id);
  EXPECT_EQ(decoded.name, "");
  EXPECT_EQ(decoded.awaited, nullptr);
  EXPECT_FALSE(decoded.refined_from.has_value());
  EXPECT_EQ(decoded.model, CameraModel{});
}

TEST(CameraRecord, RefusesWhatBreaksARule) {
  CameraRecord camera;
  ExpectRefused(camera, "camera");
  camera.id = CameraId(1);
  camera.model.k2 = kNan;
  ExpectRefused(camera, "k2");
  camera.model.k2 = 0;
  camera.told_focal_share = kNan;
  ExpectRefused(camera, "told_focal_share");
  camera.told_focal_share = 0;
  camera.refined_from = camera.model;
  ExpectRefused(camera, "no focal length");
  camera.refined_from->fx = 2;
  camera.refined_from->k1 = kNan;
  ExpectRefused(camera, "refined_from");
  camera.refined_from->k1 = 0;
  camera.refined_from->cx = 1;
  ExpectRefused(camera, "differs by more");
}

TEST(CameraRecord, DamagedValueIsCorruption) {
  CameraRecord camera{CameraId(1), "Nikon", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, "by hand"};
  camera.awaited =
      std::make_shared<const AwaitedPhotos>(AwaitedPhotos{{HashOf("one")}, HashOf("list")});
  Fuzz(camera, CameraId(1));
}

}  // namespace
}  // namespace veduta
