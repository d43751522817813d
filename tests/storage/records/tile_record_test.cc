// SPDX-License-Identifier: Apache-2.0
// Goal: a tile comes back as it was stored; one that breaks a rule is not encoded, and a damaged
//   value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/tile_record.h"

#include <gtest/gtest.h>

#include "tests/storage/dense_samples.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(TileRecord, RoundTrips) {
  TileRecord tile = SampleTile({-1, 2, 3});
  RoundTrip(SampleTile({-1, 2, 3}), &tile);
  EXPECT_EQ(tile.histogram_version, SampleTile({}).histogram_version);
}

TEST(TileRecord, RefusesWhatBreaksARule) {
  TileRecord tile = SampleTile({});
  tile.depths[2] = tile.depths[1];
  ExpectRefused(tile, "do not ascend");
  tile = SampleTile({});
  tile.reconstruction = {};
  ExpectRefused(tile, "reconstruction 0");
}

TEST(TileRecord, DamagedValueIsCorruption) {
  Fuzz(SampleTile({1, 2, 3}));
}

TEST(TileRecord, KeysReadBackAndSortBySignedPlaces) {
  const int32_t numbers[] = {std::numeric_limits<int32_t>::min(), -1, 0, 1,
                             std::numeric_limits<int32_t>::max()};
  for (const int32_t a : numbers) {
    ReconstructionId reconstruction;
    GridPlace read;
    ASSERT_OK(ParseDenseKey(TileKey(kCity, {a, -(a / 2), 5}), &reconstruction, &read));
    EXPECT_EQ(reconstruction, kCity);
    EXPECT_EQ(read, (GridPlace{a, -(a / 2), 5}));
    for (const int32_t b : numbers) {
      EXPECT_EQ(TileKey(kCity, {a, 0, 0}) < TileKey(kCity, {b, 0, 0}), a < b) << a << " " << b;
      EXPECT_EQ(VolumeKey(kCity, {0, 0, a}, 3) < VolumeKey(kCity, {0, 0, b}, 3), a < b);
    }
  }
  EXPECT_TRUE(VolumeKey(kCity, {1, 2, 3}, 63).starts_with(VolumePrefix(kCity, {1, 2, 3})));
  EXPECT_TRUE(SurfaceKey(SurfacePart::kMesh, kCity, {1, 2, 3})
                  .starts_with(SurfacePrefix(SurfacePart::kMesh, kCity)));
}

}  // namespace
}  // namespace veduta
