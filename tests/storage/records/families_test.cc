// SPDX-License-Identifier: Apache-2.0
// Goal: names and numbers of families, which files and digests hold, never change.
// Method: the list as it was when the numbers were first fed to a digest.
#include "storage/records/families.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(Families, NumbersAndNamesArePinned) {
  // In order of their numbers. A new family is added at the end; nothing else ever changes here.
  const char* const names[] = {
      "meta",       "cameras", "names",           "hashes",  "photos",       "features",
      "images",     "pairs",   "reconstructions", "poses",   "observations", "points",
      "vocabulary", "words",   "postings",        "queue",   "journal",      "dense",
      "depth",      "volume",  "surface",         "uploads", "contributions"};
  ASSERT_EQ(std::size(names), kFamilyCount);
  for (size_t i = 0; i < kFamilyCount; ++i) {
    EXPECT_STREQ(FamilyName(static_cast<Family>(i)), names[i]);
    EXPECT_EQ(FindFamily(names[i]), static_cast<Family>(i));
    EXPECT_EQ(AllFamilies()[i].family, static_cast<Family>(i));
  }
  EXPECT_EQ(FindFamily("murals"), std::nullopt);
}

TEST(Families, DigestTakesTheOfflinePassWhole) {
  // These numbers enter the digest of every database that has been made dense.
  EXPECT_EQ(static_cast<int>(Family::kDense), 17);
  EXPECT_EQ(static_cast<int>(Family::kDepth), 18);
  EXPECT_EQ(static_cast<int>(Family::kVolume), 19);
  EXPECT_EQ(static_cast<int>(Family::kSurface), 20);
  std::vector<Family> whole, since_two;
  for (const FamilyTraits& traits : AllFamilies()) {
    if (traits.digested_whole) whole.push_back(traits.family);
    if (traits.since_format == 2) since_two.push_back(traits.family);
  }
  EXPECT_EQ(whole, (std::vector<Family>{Family::kDense, Family::kDepth, Family::kVolume,
                                        Family::kSurface}));
  EXPECT_EQ(since_two, whole) << "format 2 came with the dense pass";
}

}  // namespace
}  // namespace veduta
