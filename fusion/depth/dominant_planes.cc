// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/dominant_planes.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr uint32_t kGridPoints = 4000;  // about
constexpr int kTrials = 1000;  // three of a fifth of the points are drawn with probability 0.9997
constexpr double kShareMin = 0.05;      // of the grid
constexpr double kAreaShareMin = 1e-3;  // of the view, of the triangle of three points
constexpr int kRefinements = 3;

struct GridPoint {
  double x, y, w;
};

std::vector<GridPoint> TakeGrid(const InverseDepthMap& map,
                                const std::vector<uint8_t>& confidence) {
  const double pixels = static_cast<double>(map.w.size());
  const uint32_t step = std::max(1u, static_cast<uint32_t>(std::sqrt(pixels / kGridPoints)));
  std::vector<GridPoint> points;
  for (uint32_t y = step / 2; y < map.height_px; y += step) {
    for (uint32_t x = step / 2; x < map.width_px; x += step) {
      const size_t pixel = static_cast<size_t>(y) * map.width_px + x;
      if (confidence[pixel] > 0 && !std::isnan(map.w[pixel])) {
        points.push_back({static_cast<double>(x), static_cast<double>(y), map.w[pixel]});
      }
    }
  }
  return points;
}

bool IsOn(const PlaneInView& plane, const GridPoint& p, double difference_max) {
  return std::abs(plane.x * p.x + plane.y * p.y + plane.constant - p.w) <= difference_max;
}

size_t CountOn(const PlaneInView& plane, const std::vector<GridPoint>& points,
               double difference_max) {
  return static_cast<size_t>(std::count_if(points.begin(), points.end(), [&](const GridPoint& p) {
    return IsOn(plane, p, difference_max);
  }));
}

// False if the three are nearly on a line.
bool ThroughThree(const GridPoint& a, const GridPoint& b, const GridPoint& c, double area_min,
                  PlaneInView* plane) {
  const double determinant = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (std::abs(determinant) < 2 * area_min) return false;
  plane->x = ((b.w - a.w) * (c.y - a.y) - (c.w - a.w) * (b.y - a.y)) / determinant;
  plane->y = ((b.x - a.x) * (c.w - a.w) - (c.x - a.x) * (b.w - a.w)) / determinant;
  plane->constant = a.w - plane->x * a.x - plane->y * a.y;
  return true;
}

// Least squares on the points that are on it.
void Refine(const std::vector<GridPoint>& points, double difference_max, PlaneInView* plane) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const GridPoint& p : points) {
    if (!IsOn(*plane, p, difference_max)) continue;
    const Eigen::Vector3d row(p.x, p.y, 1);
    normal += row * row.transpose();
    right += p.w * row;
  }
  if (normal.determinant() <= 0) return;
  const Eigen::Vector3d solved = normal.ldlt().solve(right);
  if (solved.allFinite()) *plane = {solved.x(), solved.y(), solved.z()};
}

}  // namespace

std::vector<PlaneInView> FindDominantPlanes(const InverseDepthMap& map,
                                            const std::vector<uint8_t>& confidence,
                                            double difference_max, uint32_t count_max) {
  std::vector<PlaneInView> planes;
  std::vector<GridPoint> points = TakeGrid(map, confidence);
  const size_t count_min =
      std::max<size_t>(8, static_cast<size_t>(kShareMin * static_cast<double>(points.size())));
  const double area_min = kAreaShareMin * static_cast<double>(map.w.size());
  SeededRandom random(1);
  while (planes.size() < count_max && points.size() >= count_min) {
    PlaneInView best;
    size_t best_count = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto draw = [&]() -> const GridPoint& {
        return points[random.Below(static_cast<uint32_t>(points.size()))];
      };
      const GridPoint &a = draw(), &b = draw(), &c = draw();
      PlaneInView plane;
      if (!ThroughThree(a, b, c, area_min, &plane)) continue;
      const size_t count = CountOn(plane, points, difference_max);
      if (count <= best_count) continue;
      best_count = count;
      best = plane;
    }
    if (best_count < count_min) break;
    for (int i = 0; i < kRefinements; ++i) Refine(points, difference_max, &best);
    planes.push_back(best);
    // Pixels near the plane belong to it as well, or the next plane would be the same again.
    std::erase_if(points, [&](const GridPoint& p) { return IsOn(best, p, 3 * difference_max); });
  }
  return planes;
}

}  // namespace veduta
