// SPDX-License-Identifier: Apache-2.0
// Goal: a photo of another camera than the city's, which nobody names, is localised with its focal
//   length and distortion; one that is stored, or shows nothing known, is answered as ever; nothing
//   is stored.
// Method: photos of a rendered street; what is asked about is taken by a camera of another size,
//   focal length and distortion.
#include "engine/localization/unknown_localization.h"

#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

CameraModel Phone() {
  CameraModel model;
  model.width_px = 600;
  model.height_px = 400;
  model.fx = model.fy = 640;
  model.cx = model.u0 = 302;
  model.cy = model.v0 = 198;
  model.k1 = -0.08;
  return model;
}

PhotoSource Source(const std::string& name, std::vector<uint8_t> bytes) {
  return {name, name, std::move(bytes)};
}

PhotoSource TakeByPhone(const Rigid3& cam_from_world) {
  street::StreetCamera camera;
  camera.model = Phone();
  camera.cam_from_world = cam_from_world;
  street::RenderOptions render;
  render.noise_sigma = 2;
  const auto photo = street::RenderPhoto(SharedScene(), camera, render);
  EXPECT_OK(photo);
  auto jpeg = street::EncodeJpeg(*photo, 92);
  EXPECT_OK(jpeg);
  return Source("phone.jpg", std::move(*jpeg));
}

LocalizedPhoto Localize(const City& city, const PhotoSource& photo) {
  CityQuestions ask = city.Ask();
  LocalizedPhoto localized;
  EXPECT_OK(ask.door().Localize(std::vector<LocalizeRequest>{{photo, ""}},
                                [&](const LocalizedPhoto& one) { localized = one; }));
  return localized;
}

TEST(UnknownLocalization, FindsTheCameraWithThePose) {
  City city;
  city.Add(Walk(4, 1, 10));
  const std::string before = city.Digest();
  const TakenPhoto& beside = TakePhoto({8, 90});
  const LocalizedPhoto photo = Localize(city, TakeByPhone(beside.cam_from_world));
  ASSERT_TRUE(photo.cam_from_world) << photo.detail << photo.failure.message();
  ASSERT_TRUE(photo.camera);
  const CameraModel& camera = photo.camera->model;
  EXPECT_EQ(camera.width_px, 600u);
  EXPECT_EQ(camera.height_px, 400u);
  EXPECT_NEAR(camera.fx / Phone().fx, 1, 0.02);
  EXPECT_NEAR(camera.k1, Phone().k1, 0.04);
  EXPECT_LT(photo.camera->focal_stddev_share, 0.02);
  EXPECT_TRUE(photo.uncertainty);
  EXPECT_FALSE(photo.support.empty());
  EXPECT_EQ(city.Digest(), before);
}

TEST(UnknownLocalization, WhereItWasTakenIsLookedFirst) {
  City city;
  city.Add(Walk(4, 1, 10));
  const PhotoSource photo = TakeByPhone(TakePhoto({8, 90}).cam_from_world);
  for (const char* near : {"", "#6", "#1"}) {
    LocalizeRequest request{photo, ""};
    request.near = near;
    CityQuestions ask = city.Ask();
    LocalizedPhoto localized;
    EXPECT_OK(ask.door().Localize(std::vector<LocalizeRequest>{request},
                                  [&](const LocalizedPhoto& one) { localized = one; }));
    ASSERT_TRUE(localized.camera) << near << ": " << localized.detail;
    EXPECT_NEAR(localized.camera->model.fx / Phone().fx, 1, 0.02) << near;
  }
}

// The phone's is 38.4 mm.
TEST(UnknownLocalization, AFocalLengthThatIsToldWronglyDoesNoHarm) {
  City city;
  city.Add(Walk(4, 1, 10));
  const PhotoSource untold = TakeByPhone(TakePhoto({8, 90}).cam_from_world);
  for (const double told_mm : {38, 42, 20, 80}) {
    const ExifCamera exif{"Maker", "Phone", "", 5.5, 0, told_mm};
    const LocalizedPhoto photo =
        Localize(city, Source("told.jpg", testing::WithExif(*untold.bytes, testing::ExifOf(exif))));
    ASSERT_TRUE(photo.camera) << told_mm << ": " << photo.detail << photo.failure.message();
    EXPECT_NEAR(photo.camera->model.fx / Phone().fx, 1, 0.02) << told_mm;
  }
}

TEST(UnknownLocalization, AStoredPhotoHasTheCameraThatItWasStoredWith) {
  City city;
  city.Add(Walk(4, 1, 6));
  const TakenPhoto& stored = TakePhoto(Walk(4, 1, 6)[3]);
  const LocalizedPhoto photo = Localize(city, Source(stored.name, stored.jpeg));
  EXPECT_TRUE(photo.stored.valid());
  EXPECT_TRUE(photo.cam_from_world) << photo.detail;
  EXPECT_FALSE(photo.camera);
}

TEST(UnknownLocalization, WhatShowsNothingKnownIsRefused) {
  City city;
  city.Add(Walk(4, 1, 6));
  const TakenPhoto& elsewhere = TakePhoto({40, 270});
  const LocalizedPhoto photo = Localize(city, Source(elsewhere.name, elsewhere.jpeg));
  EXPECT_EQ(photo.verdict, Verdict::kPostponed);
  EXPECT_FALSE(photo.cam_from_world);
  EXPECT_FALSE(photo.camera);
  EXPECT_NE(photo.reason, Reason::kNone);
  const LocalizedPhoto text = Localize(city, Source("text.jpg", {1, 2, 3}));
  EXPECT_EQ(text.verdict, Verdict::kRejected);
}

}  // namespace
}  // namespace veduta
