// SPDX-License-Identifier: Apache-2.0
// Goal: the outline of a marker is found to about a pixel, also where a third of it is covered, and
//   is then refined: its centre to a small part of a pixel, its half axes to the reach of the steps
//   that the edge is looked for with; the share of it that is seen and its contrast are told; images
//   without outlines give none.
// Method: markers drawn with known half axes, whole and covered; images of one grey, of noise, and
//   too small.
#include "engine/camera/markers/outline.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "storage/base/content_hash.h"
#include "tests/engine/camera/markers/drawn_marker.h"

namespace veduta {
namespace {

using testing::DrawnMarker;

constexpr int kOffsetGray = 6;

double DistanceOf(const Ellipse& found, const Eigen::Vector2d& center, double major, double minor) {
  return std::max({(found.center - center).norm(), std::abs(found.major - major),
                   std::abs(found.minor - minor)});
}

// How far an axis may come out short: of equal steps across a sharp edge the innermost counts.
double StepReach(double axis_px) {
  return std::clamp(0.06 * axis_px, 0.75, 4.0);
}

void ExpectRefined(const Ellipse& fine, const Eigen::Vector2d& center, double major, double minor) {
  EXPECT_LT((fine.center - center).norm(), 0.3) << major << " " << minor;
  for (const auto& [found, truth] : {std::pair(fine.major, major), {fine.minor, minor}}) {
    EXPECT_LT(found, truth + 0.3);
    EXPECT_GT(found, truth - StepReach(truth) - 0.3);
  }
}

// The ellipse of FindOutlines that is nearest to the true one.
std::optional<Ellipse> Nearest(const cv::Mat& gray, const Eigen::Vector2d& center, double major,
                               double minor) {
  const std::vector<Ellipse> found = FindOutlines(gray, kOffsetGray);
  if (found.empty()) return std::nullopt;
  return *std::min_element(found.begin(), found.end(), [&](const Ellipse& a, const Ellipse& b) {
    return DistanceOf(a, center, major, minor) < DistanceOf(b, center, major, minor);
  });
}

TEST(Outline, FoundToAPixelAndRefinedToAFraction) {
  for (const auto& [major, minor] : {std::pair(70., 70.), {70., 40.}, {24., 20.}, {12., 11.}}) {
    const Eigen::Vector2d center(121.3, 98.6);
    const DrawnMarker marker(3, center, {major, minor}, 0.7);
    const auto coarse = Nearest(marker.gray, center, major, minor);
    ASSERT_TRUE(coarse) << major;
    EXPECT_LT(DistanceOf(*coarse, center, major, minor), 1.5) << major << " " << minor;
    const auto fine = RefineOutline(marker.gray, *coarse);
    ASSERT_TRUE(fine) << major;
    ExpectRefined(fine->ellipse, center, major, minor);
    EXPECT_GE(fine->support, 0.95);
    EXPECT_LE(fine->support, 1);
    EXPECT_NEAR(fine->contrast_gray, testing::kPaperGray - testing::kInkGray, 60);
  }
}

TEST(Outline, AnArcIsEnoughAndItsShareIsTold) {
  const Eigen::Vector2d center(120, 100);
  DrawnMarker marker(3, center, {60, 60}, 0);
  marker.CoverSectors(0, 7, static_cast<uint8_t>(testing::kPaperGray));  // 30 % of the outline
  const auto coarse = Nearest(marker.gray, center, 60, 60);
  ASSERT_TRUE(coarse);
  EXPECT_LT(DistanceOf(*coarse, center, 60, 60), 4);
  const auto fine = RefineOutline(marker.gray, *coarse);
  ASSERT_TRUE(fine);
  ExpectRefined(fine->ellipse, center, 60, 60);
  EXPECT_NEAR(fine->support, 1 - 7. / 23, 0.06);
  marker.CoverSectors(0, 13, static_cast<uint8_t>(testing::kPaperGray));
  EXPECT_FALSE(RefineOutline(marker.gray, {center, 60, 60, 0})) << "less than half is seen";
}

TEST(Outline, NoneWhereThereIsNone) {
  EXPECT_TRUE(FindOutlines(cv::Mat(200, 240, CV_8UC1, cv::Scalar(90)), kOffsetGray).empty());
  EXPECT_TRUE(FindOutlines(cv::Mat(8, 240, CV_8UC1, cv::Scalar(90)), kOffsetGray).empty());
  EXPECT_TRUE(FindOutlines(cv::Mat(), kOffsetGray).empty());
  cv::Mat noise(200, 240, CV_8UC1);
  SeededRandom random(1);
  for (int v = 0; v < noise.rows; ++v) {
    for (int u = 0; u < noise.cols; ++u)
      noise.at<uint8_t>(v, u) = static_cast<uint8_t>(random.Below(256));
  }
  for (const Ellipse& ellipse : FindOutlines(noise, kOffsetGray)) {
    const auto fine = RefineOutline(noise, ellipse);
    EXPECT_TRUE(!fine || fine->ellipse.major < 20) << "no large outline in noise";
  }
  EXPECT_FALSE(RefineOutline(cv::Mat(200, 240, CV_8UC1, cv::Scalar(90)), {{120, 100}, 50, 50, 0}));
}

TEST(GrayAt, IsBilinearAndKnowsTheBorder) {
  cv::Mat gray(2, 3, CV_8UC1, cv::Scalar(0));
  gray.at<uint8_t>(0, 1) = 100;
  gray.at<uint8_t>(1, 1) = 200;
  EXPECT_DOUBLE_EQ(*GrayAt(gray, {1, 0}), 100);
  EXPECT_DOUBLE_EQ(*GrayAt(gray, {0.5, 0.25}), 0.5 * (0.75 * 100 + 0.25 * 200));
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(-0.01, 0), {0, -0.01}, {2, 0}, {0, 1}})
    EXPECT_FALSE(GrayAt(gray, px)) << px.transpose();
  EXPECT_FALSE(GrayAt(gray, {std::nan(""), 0}));
}

}  // namespace
}  // namespace veduta
