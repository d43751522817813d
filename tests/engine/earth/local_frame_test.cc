// SPDX-License-Identifier: Apache-2.0
// Goal: metres about an origin and degrees of the earth go into each other exactly.
// Method: there and back at places all over the earth; lengths of degrees that are known (WGS 84);
//   the rotation between two frames against three steps of a metre; places about the earth's centre
//   by the ellipsoid's axes.
#include "engine/earth/local_frame.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(LocalFrame, GoesThereAndBack) {
  for (const GeoPosition& origin : {GeoPosition{47.07, 15.44, 350}, GeoPosition{-33.9, 151.2, 20},
                                    GeoPosition{0, 0, 0}, GeoPosition{71, -179.9, -5}}) {
    const LocalFrame frame(origin);
    EXPECT_LT(frame.FromGeo(origin).norm(), 1e-8);
    for (const Eigen::Vector3d& enu : {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-5000, 4000, 100),
                                       Eigen::Vector3d(1e5, 0, 0)}) {
      EXPECT_LT((frame.FromGeo(frame.ToGeo(enu)) - enu).norm(), 1e-6);
    }
  }
}

TEST(LocalFrame, KnowsHowLongADegreeIs) {
  const LocalFrame frame({0, 0, 0});
  // At the equator a degree of longitude is 111319.49 m of arc, its chord's part to the east
  // a sin(1 degree).
  EXPECT_NEAR(frame.FromGeo({0, 1, 0}).x(), 6378137 * 0.01745240643728351, 1e-3);
  EXPECT_NEAR(LocalFrame({45, 10, 0}).FromGeo({45.00001, 10, 0}).y(), 1.11132, 1e-4);
  EXPECT_NEAR(LocalFrame({45, 10, 0}).FromGeo({45, 10, 12}).z(), 12, 1e-8);
}

TEST(LocalFrame, TurnsIntoTheFrameOfAnotherPlace) {
  const LocalFrame here({47.07, 15.44, 350});
  const Eigen::Vector3d place(30000, -20000, 500);
  Eigen::Matrix3d there_from_here;
  const LocalFrame there(here.ToGeo(place, &there_from_here));
  EXPECT_LT((there_from_here * there_from_here.transpose() - Eigen::Matrix3d::Identity()).norm(),
            1e-12);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = Eigen::Vector3d::Unit(axis);
    EXPECT_LT((there.FromGeo(here.ToGeo(place + step)) - there_from_here * step).norm(), 1e-6);
  }
}

TEST(LocalFrame, StandsOnTheEarth) {
  const Eigen::Matrix4d at_equator = LocalFrame({0, 90, 10}).EcefFromEnu();
  // There y goes through the equator at 90 degrees east: up is y, east is -x, north is z.
  EXPECT_LT((at_equator * Eigen::Vector4d(1, 2, 3, 1) - Eigen::Vector4d(-1, 6378137 + 10 + 3, 2, 1))
                .norm(),
            1e-6);
  const Eigen::Matrix4d at_pole = LocalFrame({90, 0, 0}).EcefFromEnu();
  EXPECT_NEAR(at_pole(2, 3), 6356752.314245, 1e-5);
  // The distance between two places is the same in every frame.
  const LocalFrame here({47.07, 15.44, 350});
  Eigen::Vector4d there(3000, -2000, 50, 1);
  const GeoPosition place = here.ToGeo(there.head<3>());
  const Eigen::Vector4d by_itself = LocalFrame(place).EcefFromEnu().col(3);
  EXPECT_LT((here.EcefFromEnu() * there - by_itself).norm(), 1e-6);
}

}  // namespace
}  // namespace veduta
