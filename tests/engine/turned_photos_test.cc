// SPDX-License-Identifier: Apache-2.0
// Goal: photos that the map has another way round than their files are found, and no others.
// Method: a street of a few photos, in three of which the file is made to say that its picture
//   lies; the camera of one of them has it so.
#include "engine/door/turned_photos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "engine/camera/exif.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// A file whose picture lies: its EXIF says that its first row is at the right.
std::vector<uint8_t> Lying(const std::vector<uint8_t>& jpeg) {
  std::vector<uint8_t> exif = WriteExif({}, std::nullopt, std::nullopt, 6);
  const std::string_view name("Exif\0\0", 6);
  exif.insert(exif.begin(), name.begin(), name.end());
  const size_t size = exif.size() + 2;
  const uint8_t marker[] = {0xFF, 0xE1, static_cast<uint8_t>(size >> 8),
                            static_cast<uint8_t>(size & 0xFF)};
  exif.insert(exif.begin(), std::begin(marker), std::end(marker));
  std::vector<uint8_t> lying = jpeg;
  for (size_t i = 0; i + 9 < lying.size(); ++i) {
    if (lying[i] != 0xFF || lying[i + 1] != 0xC0) continue;
    std::swap_ranges(&lying[i + 5], &lying[i + 7], &lying[i + 7]);  // the sides
    break;
  }
  lying.insert(lying.begin() + 2, exif.begin(), exif.end());
  return lying;
}

TEST(FindTurnedPhotos, FindsThoseWhoseFilesLie) {
  City city;
  city.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
  const auto none = FindTurnedPhotos(city.Ask().door());
  ASSERT_OK(none);
  EXPECT_EQ(none->count, 0u);
  EXPECT_EQ(none->first, "");
  Database& database = *city.parts().database;
  const auto snapshot = database.GetSnapshot();
  const auto transaction = database.BeginTransaction();
  for (const uint32_t id : {2u, 3u, 4u}) {
    auto image = snapshot->GetImage(ImageId(id));
    ASSERT_OK(image);
    const auto photo = snapshot->GetPhoto(image->photo);
    ASSERT_OK(photo);
    const auto features = snapshot->GetFeatures(image->photo);
    ASSERT_OK(features);
    const auto bytes = photo->bytes();
    const std::vector<uint8_t> lying = Lying({bytes.begin(), bytes.end()});
    image->photo = HashContent(lying);
    image->size_bytes = lying.size();
    if (id == 4) {
      std::swap(image->width_px, image->height_px);
      image->orientation = 6;
    }
    ASSERT_OK(database.WritePhotoAhead(image->photo, lying, *features));
    transaction->PutImage(*image);
  }
  ASSERT_OK(transaction->Commit());
  const auto found = FindTurnedPhotos(city.Ask().door());
  ASSERT_OK(found);
  EXPECT_EQ(found->count, 2u);
  EXPECT_EQ(found->first, snapshot->GetImage(ImageId(2))->name);
}

}  // namespace
}  // namespace veduta
