// SPDX-License-Identifier: Apache-2.0
// Goal: photos of one camera have one name, and whatever changes the intrinsics changes the name.
// Method: headers and EXIF that differ in one thing each.
#include "engine/photo/camera_group.h"

#include <gtest/gtest.h>

#include <set>

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
  turned.orientation = 6;
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
}

TEST(CameraGroup, ThereIsNoneWithoutModelOrFocalLength) {
  PhotoHeader header;
  header.stored_size = {4032, 3024};
  EXPECT_EQ(CameraGroupOf({}, header), "");
  EXPECT_EQ(CameraGroupOf({"Apple", "", "", 4.2, 1}, header), "");
  EXPECT_EQ(CameraGroupOf({"Apple", "iPhone 12", "", 0, 1}, header), "");
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

}  // namespace
}  // namespace veduta
