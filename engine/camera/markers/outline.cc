// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/outline.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "storage/base/median.h"

namespace veduta {
namespace {

using Border = std::vector<cv::Point>;

// Chosen by hand unless a reason is given; not measured.
constexpr int kWindowPx = 31;          // the side of the area whose mean decides what is dark
constexpr int kBorderPxMin = 16;       // shorter borders are passed over; 10 by 4 px have 20
constexpr double kMinorPxMin = 1.8;    // of the shorter half axis
constexpr double kAxesRatioMin = 0.2;  // minor over major: a tilt of 78 degrees
constexpr size_t kFitPoints = 64;      // taken evenly from a border

// The `count` points of the border from index `first` on, thinned to kFitPoints.
std::vector<Eigen::Vector2d> Thin(const Border& border, size_t first, size_t count) {
  std::vector<Eigen::Vector2d> points;
  const size_t taken = std::min(count, kFitPoints);
  for (size_t i = 0; i < taken; ++i) {
    const cv::Point& p = border[(first + i * count / taken) % border.size()];
    points.emplace_back(p.x, p.y);
  }
  return points;
}

std::optional<Ellipse> FitBorder(const std::vector<Eigen::Vector2d>& points, const cv::Size& size) {
  std::optional<Ellipse> ellipse = FitEllipse(points);
  if (!ellipse || ellipse->minor < kMinorPxMin || ellipse->minor < kAxesRatioMin * ellipse->major)
    return std::nullopt;
  if (ellipse->major > std::max(size.width, size.height)) return std::nullopt;
  // The RMS distance that is allowed: 0.6 px, or 3 % of a large outline's size. Chosen by hand.
  const double tolerance_px = std::max(0.6, 0.03 * std::sqrt(ellipse->major * ellipse->minor));
  double sum = 0;
  for (const Eigen::Vector2d& p : points) {
    const double distance = OutlineDistance(*ellipse, p);
    sum += distance * distance;
  }
  if (sum > tolerance_px * tolerance_px * static_cast<double>(points.size())) return std::nullopt;
  // A border runs through the centres of the outermost dark pixels, half a pixel inside of the
  // edge.
  ellipse->major += 0.5;
  ellipse->minor += 0.5;
  return ellipse;
}

// How far the border turns at each point, radians: from the chord of the `step` points before it to
// the chord of the `step` points after it.
std::vector<double> Turns(const Border& border, int step) {
  const int n = static_cast<int>(border.size());
  std::vector<double> turns(border.size());
  for (int i = 0; i < n; ++i) {
    const cv::Point a = border[(i + n - step) % n], b = border[i], c = border[(i + step) % n];
    const cv::Point before = b - a, after = c - b;
    turns[i] = std::atan2(before.cross(after), before.dot(after));
  }
  return turns;
}

// Ellipses of the border's arcs. An arc ends where the border bends the wrong way or too sharply.
void AddArcs(const Border& border, const cv::Size& size, std::vector<Ellipse>* found) {
  // Chosen by hand; not measured one by one, but together by veduta-bench-markers.
  constexpr int kStep = 6;                                      // points of a chord
  constexpr double kTurnMin = -0.4, kTurnMax = 1.0;             // radians; outside, the arc ends
  constexpr double kArcTurnMin = 150 * std::numbers::pi / 180;  // radians; shorter arcs are left
  if (border.size() < 40) return;
  std::vector<double> turns = Turns(border, kStep);
  double total = 0;
  for (const double turn : turns) total += turn;
  const double sense = total < 0 ? -1 : 1;
  // The outer border of a dark region and the border of a hole in it run opposite ways round, so
  // arcs of either sense count.
  for (const double wanted : {sense, -sense}) {
    const auto is_break = [&](size_t i) {
      return turns[i] * wanted < kTurnMin || turns[i] * wanted > kTurnMax;
    };
    const size_t n = border.size();
    size_t start = 0;
    while (start < n && !is_break(start)) ++start;
    if (start == n) continue;  // one smooth border: it has been fitted as a whole
    for (size_t i = 0; i < n;) {
      size_t length = 0;
      double turned = 0;
      while (length < n && i + length < n && !is_break((start + i + length) % n)) {
        turned += turns[(start + i + length) % n] * wanted / kStep;
        ++length;
      }
      if (length >= static_cast<size_t>(kBorderPxMin) && turned > kArcTurnMin) {
        if (const auto ellipse = FitBorder(Thin(border, start + i, length), size))
          found->push_back(*ellipse);
      }
      i += length + 1;
    }
  }
}

// The outward normal of an ellipse at the image of the unit circle's point `unit`.
Eigen::Vector2d Normal(const Eigen::Matrix2d& unit_from_image, const Eigen::Vector2d& unit) {
  return (unit_from_image.transpose() * unit).normalized();
}

struct Edge {
  Eigen::Vector2d px;
  double step_gray;
};

// The steepest rise along a line from `from` outward, within `reach_px` either side.
std::optional<Edge> FindEdge(const cv::Mat& gray, const Eigen::Vector2d& from,
                             const Eigen::Vector2d& normal, double reach_px, double width_px) {
  constexpr double kStepPx = 0.5;  // chosen by hand; not measured
  constexpr double kRiseMin = 6;   // grey levels, as MarkerOptions::offset_gray
  const int half = static_cast<int>(std::ceil(reach_px / kStepPx));
  std::vector<double> rises(2 * half + 1, -1);
  int best = -1;
  for (int i = -half; i <= half; ++i) {
    const Eigen::Vector2d at = from + i * kStepPx * normal;
    const auto inside = GrayAt(gray, at - width_px * normal),
               outside = GrayAt(gray, at + width_px * normal);
    if (!inside || !outside) continue;
    rises[i + half] = *outside - *inside;
    if (best < 0 || rises[i + half] > rises[best]) best = i + half;
  }
  if (best <= 0 || best >= 2 * half || rises[best] < kRiseMin) return std::nullopt;
  const double left = rises[best - 1], right = rises[best + 1];
  const double curvature = left - 2 * rises[best] + right;
  const double shift = curvature < 0 ? std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5) : 0;
  return Edge{from + (best - half + shift) * kStepPx * normal, rises[best]};
}

constexpr int kEdgePlaces = 60;  // around an outline, where its edge is looked for

std::vector<Edge> FindEdges(const cv::Mat& gray, const Ellipse& ellipse) {
  const Eigen::Matrix2d axes = ellipse.AxisMatrix(), unit_from_image = axes.inverse();
  std::vector<Edge> edges;
  for (int i = 0; i < kEdgePlaces; ++i) {
    const double angle = 2 * std::numbers::pi * i / kEdgePlaces;
    const Eigen::Vector2d unit(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d normal = Normal(unit_from_image, unit);
    // The dark ring is 0.17 of the radius wide. The edge is looked for within about half of that
    // along the normal, and within 1.5 px at least.
    const double depth_px = 1 / (unit_from_image.transpose() * unit).norm();
    const double reach_px = std::clamp(0.1 * depth_px, 1.5, 8.0),
                 width_px = std::clamp(0.06 * depth_px, 0.75, 4.0);
    if (const auto edge = FindEdge(gray, ellipse.At(unit), normal, reach_px, width_px))
      edges.push_back(*edge);
  }
  return edges;
}

}  // namespace

std::vector<Ellipse> FindOutlines(const cv::Mat& gray, int offset_gray) {
  std::vector<Ellipse> found;
  if (std::min(gray.rows, gray.cols) < 16) return found;
  cv::Mat smooth, mean;
  cv::GaussianBlur(gray, smooth, {3, 3}, 0);
  cv::boxFilter(smooth, mean, CV_8U, {kWindowPx, kWindowPx}, {-1, -1}, true, cv::BORDER_REPLICATE);
  cv::add(smooth, offset_gray, smooth);
  const cv::Mat dark = smooth < mean;
  std::vector<Border> borders;
  cv::findContours(dark, borders, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  for (const Border& border : borders) {
    if (border.size() < static_cast<size_t>(kBorderPxMin)) continue;
    if (const auto ellipse = FitBorder(Thin(border, 0, border.size()), gray.size())) {
      found.push_back(*ellipse);
    } else {
      AddArcs(border, gray.size(), &found);
    }
  }
  return found;
}

std::optional<Outline> RefineOutline(const cv::Mat& gray, const Ellipse& start) {
  constexpr int kRounds = 3;  // chosen by hand; not measured
  Outline outline;
  outline.ellipse = start;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Edge> edges = FindEdges(gray, outline.ellipse);
    if (edges.size() < kEdgePlaces / 2) return std::nullopt;
    std::vector<double> steps;
    for (const Edge& edge : edges) steps.push_back(edge.step_gray);
    outline.contrast_gray = MedianOf(steps);
    std::erase_if(edges,
                  [&](const Edge& edge) { return edge.step_gray < 0.3 * outline.contrast_gray; });
    // Two fits, the second without what lies far from the first.
    for (int fit = 0; fit < 2; ++fit) {
      std::vector<Eigen::Vector2d> points;
      std::vector<double> distances;
      for (const Edge& edge : edges) points.push_back(edge.px);
      const std::optional<Ellipse> ellipse = FitEllipse(points);
      if (!ellipse || ellipse->minor < kMinorPxMin ||
          ellipse->minor < kAxesRatioMin * ellipse->major) {
        return std::nullopt;
      }
      for (const Eigen::Vector2d& p : points)
        distances.push_back(std::abs(OutlineDistance(*ellipse, p)));
      const double limit_px = std::max(0.4, 3 * MedianOf(distances));
      std::erase_if(edges, [&](const Edge& e) {
        return std::abs(OutlineDistance(*ellipse, e.px)) > limit_px;
      });
      if (edges.size() < kEdgePlaces / 2) return std::nullopt;
      outline.ellipse = *ellipse;
    }
    outline.support = static_cast<double>(edges.size()) / kEdgePlaces;
  }
  if (outline.ellipse.major > 2 * start.major || outline.ellipse.major < 0.5 * start.major)
    return std::nullopt;
  return outline;
}

}  // namespace veduta
