// SPDX-License-Identifier: Apache-2.0
// Goal: up is found by how cameras are held, and said to be as sure as that allows.
// Method: cameras held level with seeded tilts, in a world that is turned; photos of a drone that
//   looks down; all into one direction; one photo that was taken lying on its side.
#include "engine/earth/up_direction.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "storage/base/content_hash.h"
#include "tests/engine/earth/level_cameras.h"

namespace veduta {
namespace {

using testing::HeldCamera;
using testing::Radians;

// A rotation of the world that nothing is special about, and up in it.
const Eigen::Quaterniond kTurn = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized();
const Eigen::Vector3d kUp = kTurn * Eigen::Vector3d::UnitZ();

Rigid3 Turned(const Rigid3& cam) {
  return TransformCameraWorld({1, kTurn, Eigen::Vector3d(4, 5, 6)}, cam);
}

double OffDeg(const UpDirection& found) {
  return std::acos(std::clamp(found.up.dot(kUp), -1.0, 1.0)) / Radians(1);
}

std::vector<Rigid3> People(double heading_range_deg, double pitch_deg) {
  SeededRandom random(7);
  std::vector<Rigid3> cams;
  for (int i = 0; i < 60; ++i) {
    const double heading = heading_range_deg * random.Unit();
    const double pitch = pitch_deg + 10 * (random.Unit() - 0.5), roll = 4 * (random.Unit() - 0.5);
    cams.push_back(Turned(HeldCamera({random.Unit(), random.Unit(), 0}, heading, pitch, roll)));
  }
  return cams;
}

TEST(FindUp, IsExactWherePeopleLookAround) {
  const auto found = FindUp(People(360, 0));
  ASSERT_FALSE(found.empty());
  EXPECT_LT(OffDeg(found.front()), 0.5);
}

TEST(FindUp, LooksPastTheTiltThatAllPhotosShare) {
  const auto found = FindUp(People(360, 15));
  ASSERT_FALSE(found.empty());
  EXPECT_LT(OffDeg(found.front()), 1);
}

TEST(FindUp, IsUnsureWhereAllLookIntoOneDirection) {
  const auto found = FindUp(People(1, 15));
  ASSERT_FALSE(found.empty());
  const double off = OffDeg(found.front());
  EXPECT_GT(off, 8);  // which cannot be known
  // About the axis to the right the information is that of the pitch of a few photos.
  const Eigen::Vector3d forward = kTurn * Eigen::Vector3d::UnitY();
  const double deviation_deg =
      1 / std::sqrt(forward.dot(found.front().information * forward)) / Radians(1);
  EXPECT_GT(deviation_deg, off / 3);
  EXPECT_LT(deviation_deg, 15);
}

TEST(FindUp, OnePhotoOnItsSideChangesLittle) {
  std::vector<Rigid3> cams = People(360, 0);
  cams.push_back(Turned(HeldCamera({0, 0, 0}, 30, 0, 90)));
  EXPECT_LT(OffDeg(FindUp(cams).front()), 1);
}

TEST(FindUp, OffersBothSidesWhereADroneLooksDown) {
  std::vector<Rigid3> cams;
  for (int i = 0; i < 20; ++i)
    cams.push_back(Turned(HeldCamera({double(i), 0, 30}, 18.0 * i, -90)));
  const auto found = FindUp(cams);
  const auto is_up = [](const UpDirection& one) { return OffDeg(one) < 0.1; };
  const auto is_down = [](const UpDirection& one) { return OffDeg(one) > 179.9; };
  EXPECT_TRUE(std::ranges::any_of(found, is_up));
  EXPECT_TRUE(std::ranges::any_of(found, is_down));
}

TEST(FindUp, DoubtsThatPeopleHoldCamerasUpsideDown) {
  const auto found = FindUp(People(360, 15));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].doubt, 0);
  EXPECT_GT(found[1].doubt, 20);
  std::vector<Rigid3> above;
  for (int i = 0; i < 20; ++i)
    above.push_back(Turned(HeldCamera({double(i), 0, 30}, 18.0 * i, -90)));
  for (const UpDirection& one : FindUp(above)) EXPECT_LT(one.doubt, 0.1);
}

TEST(FindUp, KnowsNothingWithoutCameras) {
  EXPECT_TRUE(FindUp({}).empty());
}

}  // namespace
}  // namespace veduta
