// SPDX-License-Identifier: Apache-2.0
#pragma once
// From grey values to outlines that may belong to markers: elliptic, dark inside, bright outside.

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "engine/camera/markers/ellipse.h"

namespace veduta {

// The grey value at a place between pixels, by bilinear interpolation. Nothing where one of the
// four pixels needed is outside of the image. `gray` is CV_8UC1.
inline std::optional<double> GrayAt(const cv::Mat& gray, const Eigen::Vector2d& px) {
  if (!(px.x() >= 0 && px.y() >= 0 && px.x() < gray.cols - 1 && px.y() < gray.rows - 1))
    return std::nullopt;
  const int u = static_cast<int>(px.x()), v = static_cast<int>(px.y());
  const double a = px.x() - u, b = px.y() - v;
  const uint8_t* const top = gray.ptr(v) + u;
  const uint8_t* const low = gray.ptr(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * low[0] + a * low[1]);
}

// Ellipses that the borders of dark regions follow, either a whole border or an arc of at least 150
// degrees: a thing that lies over a marker's edge need not hide the marker. A pixel is dark if it
// is `offset_gray` below the mean of the 31 x 31 px around it; a slope of the light does not
// disturb that. The places are right to about 1 px, for borders run along whole pixels.
//
// `gray`: CV_8UC1. Linear in the pixels and the borders' lengths. Thread-safe, deterministic.
std::vector<Ellipse> FindOutlines(const cv::Mat& gray, int offset_gray);

struct Outline {
  Ellipse ellipse;
  double support = 0;        // [0, 1]; the share of the outline where such an edge is seen
  double contrast_gray = 0;  // the median step across the edge
};

// Fits the ellipse to the edges from dark inside to bright outside near `start`. Its centre is right
// to a fraction of a pixel. The half axes of a large, sharp outline come out short, by at most 0.06
// of them and 4 px, because the edge is the place where two points that far apart differ most, and
// of equally good places the innermost is taken. Nothing if less than half of the outline shows such
// an edge.
std::optional<Outline> RefineOutline(const cv::Mat& gray, const Ellipse& start);

}  // namespace veduta
