// SPDX-License-Identifier: Apache-2.0
// Goal: latitude and longitude are read as people write them, and nothing else is.
// Method: texts of both kinds.
#include "cli/wire/place_text.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(ParsePlace, ReadsLatitudeAndLongitude) {
  EXPECT_EQ(ParsePlace("47.07,15.44"), (GeoPosition{47.07, 15.44, 0}));
  EXPECT_EQ(ParsePlace("-33.86,-151"), (GeoPosition{-33.86, -151, 0}));
}

TEST(ParsePlace, RefusesWhatIsNone) {
  for (const char* text : {"", ",", "47.07", "47.07,", ",15", "47.07,15.44,350", "47.07, 15.44",
                           "91,15", "47,181", "nan,15", "47,inf", "north,15"})
    EXPECT_FALSE(ParsePlace(text)) << text;
}

}  // namespace
}  // namespace veduta
