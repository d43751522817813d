// SPDX-License-Identifier: Apache-2.0
// Goal: the corner of a checkerboard is found to hundredths of a pixel whatever blur, light and
//   slant, its stated sigma is honest, and derivatives are right.
// Method: numeric derivatives; boards drawn by integrating the pattern over pixels, seen
//   slanted, with noise.
#include "engine/camera/markers/board.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "engine/camera/markers/board_cost.h"
#include "engine/camera/markers/marker_pattern.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Column by column against central differences.
template <typename Cost>
void ExpectDerivatives(const Cost& cost, const typename Cost::Parameters& x) {
  const int rows = cost.NumResiduals();
  Eigen::VectorXd residuals(rows), ahead(rows), back(rows);
  Eigen::MatrixXd jacobian(rows, static_cast<int>(Cost::NUM_PARAMETERS));
  cost(x.data(), residuals.data(), jacobian.data());
  for (int k = 0; k < Cost::NUM_PARAMETERS; ++k) {
    constexpr double kStep = 1e-6;
    typename Cost::Parameters moved = x;
    moved[k] = x[k] + kStep;
    cost(moved.data(), ahead.data(), nullptr);
    moved[k] = x[k] - kStep;
    cost(moved.data(), back.data(), nullptr);
    const Eigen::VectorXd numeric = (ahead - back) / (2 * kStep);
    EXPECT_LT((numeric - jacobian.col(k)).norm(), 1e-6 * (1 + numeric.norm())) << "parameter " << k;
  }
}

TEST(BoardCost, DerivativesAreRight) {
  std::vector<BoardSample> samples;
  for (int v = -6; v <= 6; ++v) {
    for (int u = -6; u <= 6; ++u) samples.push_back({{u, v}, 100.0 + 7 * u - v * u});
  }
  BoardCost::Parameters x;
  x << 0.3, -0.2, 0.4, 1.7, 0.2, -0.1, 0.3, 0.1, 0.05, -0.03, 60, 110;
  ExpectDerivatives(BoardCost(samples, 6), x);
  for (BoardSample& sample : samples) sample.at /= 12;
  CoarseBoardCost coarse(samples);
  ExpectDerivatives(coarse,
                    (CoarseBoardCost::Parameters() << 0.02, -0.03, 0.4, 50, 100).finished());
}

// A marker seen through a homography: ink gives back 4 % of the light.
cv::Mat DrawMarker(const Eigen::Matrix3d& image_from_unit, double blur_px, double noise,
                   uint64_t seed) {
  constexpr int kSide = 160, kSamples = 6;
  const Eigen::Matrix3d unit_from_image = image_from_unit.inverse();
  cv::Mat1f image(kSide, kSide);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      int bright = 0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const Eigen::Vector3d px(u - 0.5 + (k % kSamples + 0.5) / kSamples,
                                 v - 0.5 + (k / kSamples + 0.5) / kSamples, 1);
        const Eigen::Vector2d unit = (unit_from_image * px).hnormalized();
        bright += !IsMarkerDark(5, unit.x(), unit.y());
      }
      image(v, u) = 0.04f + 0.8f * static_cast<float>(bright) / (kSamples * kSamples);
    }
  }
  cv::GaussianBlur(image, image, {}, blur_px);
  SeededRandom random(seed);
  cv::Mat gray(kSide, kSide, CV_8UC1);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const double light = 220 * std::pow(image(v, u) * (1 - 0.004 * u), 1 / 2.2);
      double gauss = -6;
      for (int k = 0; k < 12; ++k) gauss += random.Unit();
      gray.at<uint8_t>(v, u) = cv::saturate_cast<uint8_t>(light + noise * gauss);
    }
  }
  return gray;
}

Eigen::Matrix3d View(SeededRandom* random) {
  Eigen::Matrix3d view = Eigen::Matrix3d::Identity();
  const double turn = 2 * std::numbers::pi * random->Unit();
  view.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(turn).toRotationMatrix() *
                               Eigen::DiagonalMatrix<double, 2>(45, 24) *
                               Eigen::Rotation2Dd(turn + 2 * random->Unit()).toRotationMatrix();
  view.topRightCorner<2, 1>() << 80 + random->Unit(), 80 + random->Unit();
  view.bottomLeftCorner<1, 2>() << 0.1 * random->Unit(), 0.1 * random->Unit();
  return view;
}

TEST(AlignBoard, FindsTheCornerToHundredthsOfAPixel) {
  SeededRandom random(11);
  for (const double blur_px : {0.5, 1.0, 2.0}) {
    double squares = 0, chi2 = 0;
    constexpr int kViews = 12;
    for (int i = 0; i < kViews; ++i) {
      const Eigen::Matrix3d view = View(&random);
      const Eigen::Vector2d truth = view.col(2).hnormalized();
      Eigen::Matrix3d start = view;  // what outline and coarse search would say
      start.topRightCorner<2, 1>() += Eigen::Vector2d(1.2, -0.8);
      const auto fit = AlignBoard(DrawMarker(view, blur_px, 2, i), start, 1);
      ASSERT_TRUE(fit);
      const Eigen::Vector2d error = fit->center_px - truth;
      squares += error.squaredNorm() / kViews;
      chi2 += error.dot(fit->covariance_px2.inverse() * error) / (2 * kViews);
      EXPECT_GT(fit->explained, 0.9);
      EXPECT_NEAR(fit->blur_px, std::hypot(blur_px, 0.29), 0.35 * blur_px + 0.2);
    }
    EXPECT_LT(std::sqrt(squares), 0.02 + 0.02 * blur_px) << "blur " << blur_px;
    EXPECT_LT(chi2, 3) << "blur " << blur_px;
  }
}

TEST(FindBoard, LeadsFromTheOutlineToTheCorner) {
  SeededRandom random(12);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Matrix3d view = View(&random);
    std::vector<Eigen::Vector2d> outline;
    for (int k = 0; k < 60; ++k) {
      const double angle = 2 * std::numbers::pi * k / 60;
      outline.push_back(
          (view * Eigen::Vector3d(std::cos(angle), std::sin(angle), 1)).hnormalized());
    }
    const auto ellipse = FitEllipse(outline);
    ASSERT_TRUE(ellipse);
    const auto pose = FindBoard(DrawMarker(view, 0.8, 2, i), *ellipse, 150);
    ASSERT_TRUE(pose);
    EXPECT_LT((ellipse->At(pose->center_unit) - view.col(2).hnormalized()).norm(), 0.5);
  }
}

TEST(FindBoard, SeesNoneWhereThereIsNone) {
  cv::Mat plain(100, 100, CV_8UC1, cv::Scalar(90)), disc = plain.clone(), edge = plain.clone();
  cv::circle(disc, {50, 50}, 20, cv::Scalar(10), cv::FILLED);
  edge(cv::Rect(0, 0, 50, 100)) = 200;
  const Ellipse ellipse = {{50, 50}, 40, 35, 0.2};
  for (const cv::Mat& gray : {plain, disc, edge}) EXPECT_FALSE(FindBoard(gray, ellipse, 100));
  const Ellipse outside = {{95, 50}, 40, 35, 0.2};
  EXPECT_FALSE(FindBoard(plain, outside, 100));
  Eigen::Matrix3d far = Eigen::Matrix3d::Identity();
  far.topRightCorner<2, 1>() << 1e6, 1e6;
  EXPECT_FALSE(AlignBoard(plain, far, 1));
}

}  // namespace
}  // namespace veduta
