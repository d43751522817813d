// SPDX-License-Identifier: Apache-2.0
// Goal: a record of settings comes back as it was stored; one that breaks a rule is not encoded,
//   and a damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/dense_settings.h"

#include <gtest/gtest.h>

#include "tests/storage/dense_samples.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(DenseSettings, RoundTrips) {
  const DenseSettings settings{kCity, 0.25, 512, 2};
  DenseSettings decoded{.reconstruction = kCity};
  RoundTrip(settings, &decoded);
  EXPECT_EQ(decoded, settings);
}

TEST(DenseSettings, RefusesWhatBreaksARule) {
  ExpectRefused(DenseSettings{kCity, kNan, 512, 2}, "voxel size");
  ExpectRefused(DenseSettings{kCity, 1, 512, 0}, "sensor view");
  ExpectRefused(DenseSettings{{}, 1, 512, 2}, "reconstruction 0");
}

TEST(DenseSettings, DamagedValueIsCorruption) {
  Fuzz(DenseSettings{kCity, 0.25, 512, 2});
}

TEST(DenseSettings, KeyReadsBack) {
  ReconstructionId read;
  ASSERT_OK(ParseDenseKey(DenseSettingsKey(kCity), &read));
  EXPECT_EQ(read, kCity);
  for (const std::string& key :
       {DenseSettingsKey({}), DenseSettingsKey(kCity) + "x", DenseSettingsKey(kCity).substr(0, 4)})
    EXPECT_EQ(ParseDenseKey(key, &read).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
