// SPDX-License-Identifier: Apache-2.0
// Goal: the code is read off the ring in any light, with the turn that the board left open; sectors
//   that something covers are erasures; too many of them, a frame that is turned otherwise, or a
//   marker that leaves the image give nothing, and never another id.
// Method: markers drawn as their definition says, whole, shaded, covered, and cut by the image.
#include "engine/camera/markers/ring.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/engine/camera/markers/drawn_marker.h"

namespace veduta {
namespace {

using testing::DrawnMarker;

constexpr int kBudget = 5;

Eigen::Matrix3d Turned(const Eigen::Matrix3d& image_from_unit, double turn_rad) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(turn_rad).toRotationMatrix();
  return image_from_unit * turn;
}

TEST(ReadRing, SaysTheIdAndWhichEndTheCodeBeginsAt) {
  for (const MarkerId id : {0u, 17u, 95u, 177u}) {
    const DrawnMarker marker(id, {118.3, 101.7}, {60, 45}, 0.4 + id);
    const auto ahead = ReadRing(marker.gray, marker.image_from_unit, kBudget);
    ASSERT_TRUE(ahead) << id;
    EXPECT_EQ(ahead->id, id);
    EXPECT_EQ(ahead->turn_rad, 0);
    EXPECT_EQ(ahead->error_count, 0);
    EXPECT_EQ(ahead->erasure_count, 0);
    const auto back =
        ReadRing(marker.gray, Turned(marker.image_from_unit, std::numbers::pi), kBudget);
    ASSERT_TRUE(back) << id;
    EXPECT_EQ(back->id, id);
    EXPECT_EQ(back->turn_rad, std::numbers::pi);
    for (const double turn_rad : {0.6, 1.5, -1.1})
      EXPECT_FALSE(ReadRing(marker.gray, Turned(marker.image_from_unit, turn_rad), kBudget));
  }
}

TEST(ReadRing, LightAndShadowDoNotMatter) {
  DrawnMarker marker(42, {120, 100}, {60, 60}, 1);
  for (int v = 0; v < marker.gray.rows; ++v) {
    for (int u = 0; u < marker.gray.cols; ++u) {
      uint8_t& gray = marker.gray.at<uint8_t>(v, u);
      gray = static_cast<uint8_t>(gray * (u + v < 220 ? 0.3 : 0.3 + 0.7 * u / 240));
    }
  }
  const auto ring = ReadRing(marker.gray, marker.image_from_unit, kBudget);
  ASSERT_TRUE(ring);
  EXPECT_EQ(ring->id, 42u);
}

TEST(ReadRing, CoveredSectorsAreErasuresUpToTheBudget) {
  for (int count = 1; count <= 12; ++count) {
    DrawnMarker marker(7, {120, 100}, {60, 55}, 2);
    marker.CoverSectors(3, count);
    const auto ring = ReadRing(marker.gray, marker.image_from_unit, kBudget);
    EXPECT_EQ(ring.has_value(), count <= kBudget) << count;
    if (!ring) continue;
    EXPECT_EQ(ring->id, 7u);
    EXPECT_EQ(ring->erasure_count, count);
    EXPECT_FALSE(ReadRing(marker.gray, marker.image_from_unit, count - 1)) << "a smaller budget";
  }
}

TEST(ReadRing, NothingWithoutContrastOrOutsideOfTheImage) {
  DrawnMarker marker(7, {120, 100}, {60, 60}, 0);
  EXPECT_FALSE(
      ReadRing(cv::Mat(200, 240, CV_8UC1, cv::Scalar(128)), marker.image_from_unit, kBudget));
  marker.image_from_unit(0, 2) = -10;
  EXPECT_FALSE(ReadRing(marker.gray, marker.image_from_unit, kBudget));
  EXPECT_FALSE(ReadRing(cv::Mat(), marker.image_from_unit, kBudget));
}

}  // namespace
}  // namespace veduta
