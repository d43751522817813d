// SPDX-License-Identifier: Apache-2.0
// Goal: photos of one camera have one name, and whatever changes the intrinsics changes the name.
// Method: headers and EXIF that differ in one thing each.
#include "engine/photo/camera_group.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(CameraGroup, IsNamedByAllThatDecidesTheIntrinsics) {
  const ExifCamera phone{"Apple", "iPhone 12", "", 4.2, 1};
  PhotoHeader header;
  header.stored_size = {4032, 3024};
  const std::string name = CameraGroupOf(phone, header);
  EXPECT_EQ(name, "Apple iPhone 12, 4.2 mm, 4032x3024");
  EXPECT_EQ(CameraGroupOf({"Canon", "Canon EOS 5D", "EF 24-70", 35, 0}, header),
            "Canon EOS 5D, EF 24-70, 35 mm, 4032x3024");
  PhotoHeader turned = header, cropped = header;
  turned.orientation = turned.sensor_orientation = 6;
  cropped.stored_size = {4032, 3000};
  ExifCamera longer = phone, zoomed = phone, other = phone;
  longer.focal_mm = 4.25;
  zoomed.digital_zoom = 2;
  other.lens = "wide";
  EXPECT_EQ(CameraGroupOf(phone, turned), "Apple iPhone 12, 4.2 mm, 3024x4032, turned 6");
  const std::set<std::string> names = {name,
                                       CameraGroupOf(phone, turned),
                                       CameraGroupOf(phone, cropped),
                                       CameraGroupOf(longer, header),
                                       CameraGroupOf(zoomed, header),
                                       CameraGroupOf(other, header)};
  EXPECT_EQ(names.size(), 6u);
  PhotoHeader upside_down = header;  // a HEIF, whose pixels come upright
  upside_down.sensor_orientation = 3;
  EXPECT_EQ(CameraGroupOf(phone, upside_down), name + ", turned 3");
}

TEST(CameraGroup, ThereIsNoneWithoutModelOrFocalLength) {
  PhotoHeader header;
  header.stored_size = {4032, 3024};
  EXPECT_EQ(CameraGroupOf({}, header), "");
  EXPECT_EQ(CameraGroupOf({"Apple", "", "", 4.2, 1}, header), "");
  EXPECT_EQ(CameraGroupOf({"Apple", "iPhone 12", "", 0, 1}, header), "");
}

TEST(CameraGroup, WhatWasCutOrMadeSmallerIsInNone) {
  ExifCamera phone{"Apple", "iPhone 12", "", 4.2, 1, 26, 4032, 3024};
  PhotoHeader header;
  header.stored_size = {4032, 3024};
  EXPECT_NE(CameraGroupOf(phone, header), "");
  header.stored_size = {3024, 4032};
  EXPECT_NE(CameraGroupOf(phone, header), "") << "some programs turn the pixels alone";
  EXPECT_TRUE(FocalShareOf(phone, header.stored_size));
  header.stored_size = {2016, 1512};
  EXPECT_EQ(CameraGroupOf(phone, header), "") << "made smaller";
  EXPECT_TRUE(FocalShareOf(phone, header.stored_size)) << "it shows as much";
  header.stored_size = {3000, 3000};
  EXPECT_EQ(CameraGroupOf(phone, header), "") << "cut";
  EXPECT_FALSE(FocalShareOf(phone, header.stored_size));
}

TEST(CameraGroup, ItsCameraIsThatOfPhotosWithItsFocalLength) {
  TemporaryFolder folder;
  DatabaseOptions options;
  options.create = true;
  const auto database = Database::Open(folder / "db", options);
  ASSERT_OK(database);
  CameraRecord stored;
  stored.id = CameraId(1);
  stored.name = "Acme Phone, 4.2 mm, 1536x1024";
  stored.model.width_px = 1536;
  stored.model.height_px = 1024;
  stored.model.fx = stored.model.fy = 1380;
  const auto transaction = (*database)->BeginTransaction();
  transaction->PutCamera(stored);
  ASSERT_OK(transaction->Commit());
  const auto find = [&](const std::string& group, std::optional<double> share) {
    const auto found = FindGroupCamera(*(*database)->GetSnapshot(), group, share);
    EXPECT_OK(found);
    return found.ok() && *found;
  };
  EXPECT_TRUE(find(stored.name, std::nullopt));
  EXPECT_TRUE(find(stored.name, 0.95)) << "as good as EXIF is";
  EXPECT_FALSE(find(stored.name, 1.2)) << "zoomed";
  EXPECT_FALSE(find("another", std::nullopt));
  EXPECT_FALSE(find("", std::nullopt));
}

TEST(CameraGroup, ItsCameraTellsAsItsFirstPhotoDid) {
  TemporaryFolder folder;
  DatabaseOptions options;
  options.create = true;
  const auto database = Database::Open(folder / "db", options);
  ASSERT_OK(database);
  const auto transaction = (*database)->BeginTransaction();
  const auto put = [&](uint32_t id, const std::string& name, double told, double fx) {
    CameraRecord camera;
    camera.id = CameraId(id);
    camera.name = name;
    camera.model.width_px = 1000;
    camera.model.height_px = 800;
    camera.model.fx = camera.model.fy = fx;
    camera.told_focal_share = told;
    transaction->PutCamera(camera);
  };
  put(1, "Phone", 0.7, 1000);  // its photos are a third short, all of them
  put(2, "Phone (2)", 1.4, 2000);
  put(3, "Phone (x)", 2.5, 2500);
  ASSERT_OK(transaction->Commit());
  const auto find = [&](double share) {
    const auto found = FindGroupCamera(*(*database)->GetSnapshot(), "Phone", share);
    EXPECT_OK(found);
    return found.ok() && *found ? (*found)->id.value : 0;
  };
  EXPECT_EQ(find(0.7), 1u);
  EXPECT_EQ(find(0.75), 1u);
  EXPECT_EQ(find(1.45), 2u);
  EXPECT_EQ(find(1.0), 0u) << "another zoom than both";
  EXPECT_EQ(find(2.5), 0u) << "another name";
}

TEST(CameraGroup, NamesGetTheNextNumber) {
  const std::set<std::string> taken = {"a", "a (2)", "a (4)"};
  const auto is_taken = [&](const std::string& name) { return taken.contains(name); };
  EXPECT_EQ(NumberedName("b", is_taken), "b");
  EXPECT_EQ(NumberedName("a", is_taken), "a (3)");
  EXPECT_TRUE(IsNumberedName("a", "a"));
  EXPECT_TRUE(IsNumberedName("a (12)", "a"));
  for (const char* other : {"b", "a (", "a ()", "a (2", "a (2a)", "a (2) (3)", "ab (2)"})
    EXPECT_FALSE(IsNumberedName(other, "a")) << other;
}

TEST(CameraGroup, TheEquivalentOnFilmTellsTheFocalLength) {
  const auto share = [](double focal_35mm, const ImageSize& size) {
    ExifCamera camera;
    camera.focal_35mm = focal_35mm;
    return FocalShareOf(camera, size);
  };
  EXPECT_NEAR(share(26, {4032, 3024}).value(), 26 / 43.2666 * 1.25, 1e-4);
  EXPECT_EQ(share(26, {3024, 4032}), share(26, {4032, 3024}));
  EXPECT_NEAR(share(36, {3600, 2400}).value(), 1, 1e-9) << "as wide as film";
  for (const double senseless : {0.0, 5.0, 9999.0})
    EXPECT_FALSE(share(senseless, {4032, 3024})) << senseless;
  EXPECT_FALSE(share(26, {0, 0}));
}

TEST(CameraGroup, PhotosThatSayNothingAreNamedByTheirSize) {
  EXPECT_EQ(SilentGroupOf({1536, 1024}), "photos of 1536x1024");
}

}  // namespace
}  // namespace veduta
