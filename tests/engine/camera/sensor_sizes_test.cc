// SPDX-License-Identifier: Apache-2.0
// Goal: the size of a sensor is found by the camera's names, and only by them.
// Method: names as cameras write them, and names that are nearly such.
#include "engine/camera/sensor_sizes.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(SensorSizes, AreFoundByTheNamesThatCamerasWrite) {
  EXPECT_EQ(FindSensorSize("SONY", "DSC-W55"), (SensorSize{5.76, 4.29}));
  EXPECT_EQ(FindSensorSize("Apple", "iPhone 4S"), (SensorSize{4.54, 3.42}));
  EXPECT_EQ(FindSensorSize("HTC", "HTC One"), (SensorSize{5.38, 3.04})) << "named twice";
  EXPECT_EQ(FindSensorSize("OLYMPUS IMAGING CORP.", "E-520"), (SensorSize{17.3, 13.0}));
  EXPECT_EQ(FindSensorSize("OLYMPUS OPTICAL CO.,LTD", "C2Z,D520Z,C220Z"), (SensorSize{5.33, 4.0}));
}

TEST(SensorSizes, OfOtherCamerasAreNotGuessed) {
  EXPECT_EQ(FindSensorSize("", ""), std::nullopt);
  EXPECT_EQ(FindSensorSize("SONY", ""), std::nullopt);
  EXPECT_EQ(FindSensorSize("SONY", " "), std::nullopt);
  EXPECT_EQ(FindSensorSize("", "DSC-W55"), std::nullopt);
  EXPECT_EQ(FindSensorSize("Apple", "DSC-W55"), std::nullopt);
  EXPECT_EQ(FindSensorSize("SONY", "DSC-W5"), (SensorSize{7.18, 5.32})) << "a camera of its own";
  EXPECT_EQ(FindSensorSize("SONY", "DSC-W"), std::nullopt);
  EXPECT_EQ(FindSensorSize("SONY", "dsc-w50 dsc-w55"), std::nullopt) << "two names";
  EXPECT_EQ(FindSensorSize("Apple", "iPhone"), std::nullopt);
}

}  // namespace
}  // namespace veduta
