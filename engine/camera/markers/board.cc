// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/board.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/camera/markers/board_cost.h"
#include "engine/camera/markers/marker_pattern.h"
#include "engine/camera/markers/outline.h"

namespace veduta {
namespace {

// The angle of the board's x axis. A board turned by half a turn looks the same, so the second
// harmonic of the grey values along circles tells its angle. Nothing if that harmonic is weak.
std::optional<double> AngleOfBoard(const cv::Mat& gray, const Ellipse& ellipse,
                                   double contrast_gray) {
  constexpr int kPlaces = 32;
  // The least amplitude of the harmonic, over the contrast. A sharp board's is 1/pi = 0.32, that of
  // the second harmonic of a square wave between 0 and 1. Chosen by hand; not measured.
  constexpr double kAmplitudeMin = 0.2;
  std::complex<double> sum = 0;
  int count = 0;
  for (const double radius : {0.2, 0.3, 0.4}) {
    for (int i = 0; i < kPlaces; ++i) {
      const double angle = 2 * std::numbers::pi * i / kPlaces;
      const auto value =
          GrayAt(gray, ellipse.At(radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
      if (!value) return std::nullopt;
      sum += *value * std::polar(1.0, -2 * angle);
      ++count;
    }
  }
  // 0.6: the outline's contrast is measured from dark ring to paper, and blur costs the board more.
  // Chosen by hand; not measured.
  if (std::abs(sum) / count < kAmplitudeMin * 0.6 * contrast_gray) return std::nullopt;
  // The grey value is -sign(sin 2(phi - angle)), whose second Fourier coefficient is
  // (i/2) exp(-2i angle) times a positive number.
  return (std::numbers::pi / 2 - std::arg(sum)) / 2;
}

// Grey values on a grid over the board, in the unit disc of the ellipse.
std::vector<BoardSample> SampleDisc(const cv::Mat& gray, const Ellipse& ellipse) {
  constexpr int kHalf = 9;          // 19 by 19 places; chosen by hand
  constexpr double kRadius = 0.48;  // inside kMarkerBoardRadius, for the centre may be off
  std::vector<BoardSample> samples;
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const Eigen::Vector2d unit = Eigen::Vector2d(i, j) * (kRadius / kHalf);
      if (unit.norm() > kRadius) continue;
      if (const auto value = GrayAt(gray, ellipse.At(unit))) samples.push_back({unit, *value});
    }
  }
  return samples;
}

// The share of the grey values' variance that a model with half the squared residuals `cost`
// explains.
double Explained(const std::vector<BoardSample>& samples, double cost) {
  double mean = 0, total = 0;
  for (const BoardSample& sample : samples)
    mean += sample.gray / static_cast<double>(samples.size());
  for (const BoardSample& sample : samples) total += (sample.gray - mean) * (sample.gray - mean);
  return total > 0 ? 1 - 2 * cost / total : 0;
}

Eigen::Vector2d Map(const Eigen::Matrix3d& homography, const Eigen::Vector2d& x) {
  return (homography * x.homogeneous()).hnormalized();
}

// The image's pixels that lie within `radius_unit` of the corner in the marker's frame and within
// `reach_px` of it in the image.
std::vector<BoardSample> SamplePixels(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                      const Eigen::Vector2d& center_px, double radius_unit,
                                      double reach_px) {
  const Eigen::Matrix3d unit_from_image = image_from_unit.inverse();
  std::vector<BoardSample> samples;
  const int left = std::max(0, static_cast<int>(std::ceil(center_px.x() - reach_px)));
  const int top = std::max(0, static_cast<int>(std::ceil(center_px.y() - reach_px)));
  const int right = std::min(gray.cols - 1, static_cast<int>(center_px.x() + reach_px));
  const int bottom = std::min(gray.rows - 1, static_cast<int>(center_px.y() + reach_px));
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      const Eigen::Vector2d px(u, v);
      if ((px - center_px).norm() > reach_px || Map(unit_from_image, px).norm() > radius_unit)
        continue;
      samples.push_back({px - center_px, static_cast<double>(gray.at<uint8_t>(v, u))});
    }
  }
  return samples;
}

double AngleOf(const Eigen::Vector2d& v) {
  return std::atan2(v.y(), v.x());
}

// Contrast and brightness to start with, from the darkest and the brightest pixel. 0.4 of their
// difference is chosen by hand; not measured.
void StartLevels(const std::vector<BoardSample>& samples, BoardCost::Parameters* x) {
  const auto [low, high] = std::minmax_element(
      samples.begin(), samples.end(), [](const auto& a, const auto& b) { return a.gray < b.gray; });
  (*x)[BoardCost::kGain] = 0.4 * (high->gray - low->gray);
  (*x)[BoardCost::kLevel] = 0.5 * (high->gray + low->gray);
}

// The angle of the normal of a line along `along`, so that `side` is on the normal's side.
double NormalAngle(const Eigen::Vector2d& along, const Eigen::Vector2d& side) {
  const Eigen::Vector2d normal(-along.y(), along.x());
  return AngleOf(normal.dot(side) > 0 ? normal : Eigen::Vector2d(-normal));
}

// The two lines as the marker's frame tells them, unbent.
BoardCost::Parameters StartLines(const Eigen::Matrix3d& image_from_unit,
                                 const Eigen::Vector2d& center_px, double blur_px) {
  const Eigen::Vector2d along_x = Map(image_from_unit, {0.3, 0}) - center_px;
  const Eigen::Vector2d along_y = Map(image_from_unit, {0, 0.3}) - center_px;
  BoardCost::Parameters x = BoardCost::Parameters::Zero();
  x[BoardCost::kNormal] = NormalAngle(along_y, along_x);
  x[BoardCost::kNormal + 1] = NormalAngle(along_x, along_y);
  x[BoardCost::kLogBlur] = x[BoardCost::kLogBlur + 1] = std::log(blur_px);
  return x;
}

// How large the board is in the image: the least and the largest distance of its rim from its
// corner.
struct BoardExtent {
  double near_px, far_px;
};

BoardExtent ExtentOf(const Eigen::Matrix3d& image_from_unit, const Eigen::Vector2d& center_px) {
  BoardExtent extent = {std::numeric_limits<double>::infinity(), 0};
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi * i / 8;
    const Eigen::Vector2d rim =
        kMarkerBoardRadius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const double distance_px = (Map(image_from_unit, rim) - center_px).norm();
    extent.near_px = std::min(extent.near_px, distance_px);
    extent.far_px = std::max(extent.far_px, distance_px);
  }
  return extent;
}

// The radius, in the marker's frame, of the part of the board that is free of its surroundings.
// These are not symmetric about the corner, and blur carries them inwards: 2.2 sigma away it
// carries 1.4 % of an edge. The limits are chosen by hand; not measured.
double CleanRadius(const BoardExtent& extent, double blur_px) {
  constexpr double kBlursAway = 2.2, kPartMin = 0.5, kPartMax = 0.86;
  return kMarkerBoardRadius *
         std::clamp(1 - kBlursAway * blur_px / extent.near_px, kPartMin, kPartMax);
}

}  // namespace

std::optional<BoardPose> FindBoard(const cv::Mat& gray, const Ellipse& ellipse,
                                   double contrast_gray) {
  // The share of the variance that the board must explain; how far from the outline's centre its
  // corner may lie, in radii; its contrast over the outline's. Chosen by hand; not measured.
  constexpr double kExplainedMin = 0.6, kShiftMax = 0.3, kGainMin = 0.15;
  const std::optional<double> angle = AngleOfBoard(gray, ellipse, contrast_gray);
  if (!angle) return std::nullopt;
  const std::vector<BoardSample> samples = SampleDisc(gray, ellipse);
  CoarseBoardCost cost(samples);
  CoarseBoardCost::Parameters x;
  x << 0, 0, *angle, 0.5 * contrast_gray, 0;
  for (const BoardSample& sample : samples)
    x[4] += sample.gray / static_cast<double>(samples.size());
  ceres::TinySolver<CoarseBoardCost> solver;
  solver.options.max_num_iterations = 12;
  solver.options.function_tolerance = 1e-4;
  for (const double width : {0.25, 0.1}) {  // of an edge: wide ones draw from farther away
    cost.width = width;
    solver.Solve(cost, &x);
  }
  const bool is_board = x.allFinite() && x.head<2>().norm() < kShiftMax &&
                        x[3] > kGainMin * contrast_gray &&
                        Explained(samples, solver.summary.final_cost) > kExplainedMin;
  if (!is_board) return std::nullopt;
  return BoardPose{x.head<2>(), x[2]};
}

std::optional<BoardFit> AlignBoard(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                   double blur_px) {
  constexpr double kExplainedMin = 0.6;  // as in FindBoard
  constexpr size_t kPixelsMin = 14;      // two more than the parameters
  // px. The area holds pixels enough, and farther out lines bend more than the model's parabola.
  // Chosen by hand; not measured.
  constexpr double kReachPxMax = 28;
  constexpr int kRounds = 3;
  const Eigen::Vector2d start_px = Map(image_from_unit, Eigen::Vector2d::Zero());
  if (!start_px.allFinite()) return std::nullopt;
  const BoardExtent extent = ExtentOf(image_from_unit, start_px);
  if (!(extent.near_px > 1)) return std::nullopt;
  BoardFit fit;
  fit.center_px = start_px;
  Eigen::Matrix3d frame = image_from_unit;
  BoardCost::Parameters x = StartLines(image_from_unit, start_px, blur_px);
  // The first round finds place and blur. The others use only the pixels around that place that are
  // free of the blurred surroundings.
  for (int round = 0; round < kRounds; ++round) {
    const double radius_unit = CleanRadius(extent, round == 0 ? 0 : fit.blur_px);
    const double reach_px = std::min(extent.far_px * radius_unit / kMarkerBoardRadius, kReachPxMax);
    const std::vector<BoardSample> samples =
        SamplePixels(gray, frame, fit.center_px, radius_unit, reach_px);
    if (samples.size() < kPixelsMin) return std::nullopt;
    if (round == 0) StartLevels(samples, &x);
    const BoardCost cost(samples, reach_px);
    ceres::TinySolver<BoardCost> solver;
    solver.options.max_num_iterations = 30;
    solver.options.function_tolerance = 1e-7;
    solver.Solve(cost, &x);
    fit.explained = Explained(samples, solver.summary.final_cost);
    fit.blur_px = std::exp(x.segment<2>(BoardCost::kLogBlur).maxCoeff());
    const std::optional<Eigen::Matrix2d> covariance = cost.CenterCovariance(x);
    const Eigen::Vector2d shift_px = x.head<2>();
    const bool is_sound = x.allFinite() && covariance && fit.explained > kExplainedMin &&
                          x[BoardCost::kGain] > 0 &&
                          (fit.center_px + shift_px - start_px).norm() < 0.5 * extent.far_px;
    if (!is_sound) return std::nullopt;
    fit.covariance_px2 = *covariance;
    fit.center_px += shift_px;
    frame = Eigen::Affine2d(Eigen::Translation2d(shift_px)).matrix() * frame;
    x.head<2>().setZero();
    // A shift this small, in px, selects the same pixels again.
    if (round > 0 && shift_px.norm() < 0.05) break;
  }
  return fit;
}

}  // namespace veduta
