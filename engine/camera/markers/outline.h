// SPDX-License-Identifier: Apache-2.0
#pragma once
// From grey values to outlines that might be markers': dark inside, bright outside, elliptic.

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "engine/camera/markers/ellipse.h"

namespace veduta {

// Bilinear; nothing within less than a pixel outside of the image or beyond. `gray` is CV_8UC1.
inline std::optional<double> GrayAt(const cv::Mat& gray, const Eigen::Vector2d& px) {
  if (!(px.x() >= 0 && px.y() >= 0 && px.x() < gray.cols - 1 && px.y() < gray.rows - 1))
    return std::nullopt;
  const int u = static_cast<int>(px.x()), v = static_cast<int>(px.y());
  const double a = px.x() - u, b = px.y() - v;
  const uint8_t* const top = gray.ptr(v) + u;
  const uint8_t* const low = gray.ptr(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * low[0] + a * low[1]);
}

// Ellipses that borders of dark regions follow, all of a border or an arc of at least 150 degrees,
// so that something that lies over a marker's edge need not hide it. Dark: `offset_gray` below the
// mean of the 31 x 31 px around, which no slope of the light disturbs. The borders' whole pixels
// say where: right to about 1 px.
//
// `gray`: CV_8UC1. Linear in the pixels and the borders' lengths. Thread-safe, deterministic.
std::vector<Ellipse> FindOutlines(const cv::Mat& gray, int offset_gray);

struct Outline {
  Ellipse ellipse;
  double support = 0;        // [0, 1]: the part of the outline where such an edge is seen
  double contrast_gray = 0;  // median step across it
};

// Fits the ellipse to the edges from dark inside to bright outside near `start`, to a fraction of a
// pixel. Nothing if less than half of the outline shows such an edge.
std::optional<Outline> RefineOutline(const cv::Mat& gray, const Ellipse& start);

}  // namespace veduta
