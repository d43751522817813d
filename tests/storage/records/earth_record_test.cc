// SPDX-License-Identifier: Apache-2.0
// Goal: what records tell of the earth comes back as it was stored, inside of images and
//   reconstructions and by itself; what breaks a rule is not encoded, and a damaged value is
//   kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/earth_record.h"

#include <gtest/gtest.h>

#include "storage/records/image_record.h"
#include "storage/records/reconstruction_record.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

GroundPoint Sample() {
  return {"gcp 7", {47.07, 15.44, 353.2}, 0.02, {{ImageId(3), 1024.5, 7}, {ImageId(70000), -1, 2}}};
}

Georeference SampleGeoreference() {
  Georeference georeference;
  georeference.version = 3;
  georeference.images_at_look = 12;
  georeference.images_at_adjustment = 11;
  EarthPlace& place = georeference.place.emplace();
  place.origin = {-33.86, 151.2, 20};
  place.enu_from_world = {7.5, Eigen::Quaterniond(0.4, 0.2, -0.6, 0.5).normalized(), {1, -2, 3}};
  place.pivot = {4, 5, 6};
  for (size_t i = 0; i < place.covariance.size(); ++i) place.covariance[i] = 0.5 * double(i);
  place.fixes = {12, 11, 3.5};
  place.ground_points = {4, 4, 0.021};
  return georeference;
}

TEST(EarthRecord, GroundPointsRoundTrip) {
  const GroundPoint point = Sample();
  GroundPoint decoded;
  ASSERT_OK(ParseGroundPointKey(GroundPointKey(point.name), &decoded));
  RoundTrip(point, &decoded);
  EXPECT_EQ(decoded, point);
  const GroundPoint unseen{std::string("a\0b\xff", 4), {90, -180, 0}, 1, {}};
  ASSERT_OK(ParseGroundPointKey(GroundPointKey(unseen.name), &decoded));
  RoundTrip(unseen, &decoded);
  EXPECT_EQ(decoded, unseen);
}

TEST(EarthRecord, GroundPointsThatBreakARuleAreRefused) {
  GroundPoint point = Sample();
  point.name.clear();
  ExpectRefused(point, "name");
  point = Sample();
  point.position.latitude_deg = 90.5;
  ExpectRefused(point, "latitude");
  point = Sample();
  point.position.longitude_deg = kNan;
  ExpectRefused(point, "longitude");
  point = Sample();
  point.position.height_m = 2e5;
  ExpectRefused(point, "height");
  point = Sample();
  point.deviation_m = 0;
  ExpectRefused(point, "deviation_m");
  point = Sample();
  point.sightings[1].image = point.sightings[0].image;
  ExpectRefused(point, "sightings");
  point = Sample();
  point.sightings[0].image = ImageId();
  ExpectRefused(point, "image");
  point = Sample();
  point.sightings[0].x_px = kNan;
  ExpectRefused(point, "x_px");
}

TEST(EarthRecord, DamagedGroundPointsAreCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
  GroundPoint point;
  for (const char* key : {"", "ground", "ground/", "forbidden/x"})
    EXPECT_EQ(ParseGroundPointKey(key, &point).code(), StatusCode::kCorruption) << key;
}

TEST(EarthRecord, ImagesKeepWhereTheySayTheyWereTaken) {
  ImageRecord image = SampleImage(9), decoded;
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.gps, std::nullopt);
  image.gps = GpsFix{47.07, -15.44, -3.5, 4.25, 359.5};
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.gps, image.gps);
  image.gps->height_m.reset();
  image.gps->accuracy_m = 0;
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.gps, image.gps);
  image.gps->latitude_deg = 91;
  ExpectRefused(image, "latitude");
  image.gps = GpsFix{1, 2, 3, -1, {}};
  ExpectRefused(image, "accuracy_m");
  image.gps = GpsFix{1, 2, 3, 4, 360};
  ExpectRefused(image, "heading_deg");
}

TEST(EarthRecord, ReconstructionsKeepTheirPlace) {
  ReconstructionRecord record = SampleReconstruction(8, 0), decoded;
  RoundTrip(record, &decoded, record.id);
  EXPECT_FALSE(decoded.georeference.place.has_value());
  record.georeference = SampleGeoreference();
  RoundTrip(record, &decoded, record.id);
  ASSERT_TRUE(decoded.georeference.place.has_value());
  const EarthPlace& place = *decoded.georeference.place;
  const EarthPlace& wanted = *record.georeference.place;
  EXPECT_EQ(decoded.georeference.version, 3u);
  EXPECT_EQ(decoded.georeference.images_at_look, 12u);
  EXPECT_EQ(decoded.georeference.images_at_adjustment, 11u);
  EXPECT_EQ(place.origin, wanted.origin);
  EXPECT_EQ(place.enu_from_world.scale, 7.5);
  EXPECT_EQ(place.enu_from_world.rotation.coeffs(), wanted.enu_from_world.rotation.coeffs());
  EXPECT_EQ(place.enu_from_world.translation, wanted.enu_from_world.translation);
  EXPECT_EQ(place.pivot, wanted.pivot);
  EXPECT_EQ(place.covariance, wanted.covariance);
  EXPECT_EQ(place.fixes, wanted.fixes);
  EXPECT_EQ(place.ground_points, wanted.ground_points);
  record.georeference.place.reset();  // a place that is not known any more
  RoundTrip(record, &decoded, record.id);
  EXPECT_EQ(decoded.georeference.version, 3u);
  EXPECT_FALSE(decoded.georeference.place.has_value());
}

TEST(EarthRecord, DamagedPlacesAreCorruption) {
  ReconstructionRecord record = SampleReconstruction(8, 0);
  record.georeference = SampleGeoreference();
  Fuzz(record, record.id);
  ImageRecord image = SampleImage(9);
  image.gps = GpsFix{47.07, -15.44, -3.5, 4.25, 359.5};
  Fuzz(image, image.id);
}

TEST(EarthRecord, PlacesThatBreakARuleAreRefused) {
  ReconstructionRecord record = SampleReconstruction(8, 0);
  const auto refused = [&](const auto& change, const char* word) {
    record.georeference = SampleGeoreference();
    change(record.georeference);
    ExpectRefused(record, word);
  };
  refused([](Georeference& g) { g.version = 0; }, "version");
  refused([](Georeference& g) { g.place->origin.latitude_deg = -91; }, "latitude");
  refused([](Georeference& g) { g.place->enu_from_world.scale = 0; }, "scale");
  refused([](Georeference& g) { g.place->enu_from_world.translation.x() = kNan; }, "translation");
  refused([](Georeference& g) { g.place->pivot.z() = kNan; }, "pivot");
  refused([](Georeference& g) { g.place->covariance[27] = kNan; }, "covariance");
  refused([](Georeference& g) { g.place->fixes.agreeing = 13; }, "agreeing");
  refused([](Georeference& g) { g.place->ground_points.error_m = -1; }, "error_m");
}

}  // namespace
}  // namespace veduta
