// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/inverse_depth_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "storage/base/median.h"

namespace veduta {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
// Chosen by hand; no measurement is recorded.
constexpr int kRadius = 2;

// In [-0.5, 0.5] steps.
float BetweenPlanes(uint16_t before, uint16_t cost, uint16_t after) {
  if (before == UINT16_MAX || after == UINT16_MAX) return 0;
  const int left = before - cost, right = after - cost;
  const int steeper = std::max(left, right);
  if (steeper <= 0) return 0;
  return static_cast<float>(left - right) / static_cast<float>(2 * steeper);
}

// Of a window that shrinks at the borders but stays symmetric: a slope keeps its middle.
float MedianAround(const InverseDepthMap& map, int x, int y) {
  std::array<float, (2 * kRadius + 1) * (2 * kRadius + 1)> values{};
  size_t count = 0;
  const int width = static_cast<int>(map.width_px), height = static_cast<int>(map.height_px);
  const int radius_x = std::min({kRadius, x, width - 1 - x}),
            radius_y = std::min({kRadius, y, height - 1 - y});
  for (int v = y - radius_y; v <= y + radius_y; ++v) {
    for (int u = x - radius_x; u <= x + radius_x; ++u) {
      values[count++] = map.w[static_cast<size_t>(v) * map.width_px + static_cast<size_t>(u)];
    }
  }
  return QuantileInPlace(std::span(values.data(), count), 0.5);
}

float MeanAround(const InverseDepthMap& map, int x, int y, float difference_max) {
  const int width = static_cast<int>(map.width_px), height = static_cast<int>(map.height_px);
  const float centre = map.w[static_cast<size_t>(y) * map.width_px + static_cast<size_t>(x)];
  float sum = 0;
  int count = 0;
  // Points that mirror each other count together or not at all, so that a slope is kept at the edge
  // of its patch.
  for (int dy = -kRadius; dy <= kRadius; ++dy) {
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      if (dy < 0 || (dy == 0 && dx < 0)) continue;
      if (x - std::abs(dx) < 0 || x + std::abs(dx) >= width || y - dy < 0 || y + dy >= height)
        continue;
      const float a =
          map.w[static_cast<size_t>(y + dy) * map.width_px + static_cast<size_t>(x + dx)];
      const float b =
          map.w[static_cast<size_t>(y - dy) * map.width_px + static_cast<size_t>(x - dx)];
      if (std::abs(a - centre) > difference_max || std::abs(b - centre) > difference_max) continue;
      sum += a + b;
      count += 2;
    }
  }
  return count == 0 ? centre : sum / static_cast<float>(count);
}

template <typename Function>
InverseDepthMap Filter(const InverseDepthMap& map, ThreadPool& pool, const Function& function) {
  InverseDepthMap out = map;
  pool.ParallelFor(map.height_px, [&](size_t y) {
    for (uint32_t x = 0; x < map.width_px; ++x) {
      out.w[y * map.width_px + x] = function(static_cast<int>(x), static_cast<int>(y));
    }
  });
  return out;
}

// Known values of a row spread over its gaps. False if none is known.
bool FillRow(float* row, uint32_t width) {
  uint32_t x = 0;
  bool any = false;
  while (x < width) {
    if (!std::isnan(row[x])) {
      any = true;
      ++x;
      continue;
    }
    uint32_t end = x;
    while (end < width && std::isnan(row[end])) ++end;
    if (x == 0 && end == width) return false;
    const float left = x > 0 ? row[x - 1] : row[end], right = end < width ? row[end] : left;
    std::fill(row + x, row + end, std::min(left, right));
    x = end;
  }
  return any;
}

}  // namespace

InverseDepthMap RefineBetweenPlanes(const PlaneChoice& choice, uint32_t width_px,
                                    uint32_t height_px, const std::vector<float>& base,
                                    const std::vector<SweepPlane>& planes) {
  InverseDepthMap map{width_px, height_px,
                      std::vector<float>(static_cast<size_t>(width_px) * height_px)};
  for (size_t i = 0; i < map.w.size(); ++i) {
    const float x = static_cast<float>(i % width_px), y = static_cast<float>(i / width_px);
    const auto at = [&](size_t k) {
      return planes[k].x * x + planes[k].y * y + planes[k].constant;
    };
    const size_t k = choice.plane[i];
    const float between =
        BetweenPlanes(choice.cost_before[i], choice.cost[i], choice.cost_after[i]);
    // Towards a gap there is no step.
    const float step = between > 0 ? at(k + 1) - at(k) : between < 0 ? at(k) - at(k - 1) : 0;
    map.w[i] = (base.empty() ? 0 : base[i]) + at(k) + (std::isnan(step) ? 0 : between * step);
  }
  return map;
}

void RemoveSpeckles(double difference_max, uint32_t pixels_min, InverseDepthMap* map) {
  const size_t width = map->width_px, count = map->w.size();
  const float limit = static_cast<float>(difference_max);
  std::vector<uint8_t> is_seen(count, 0);
  std::vector<size_t> patch;
  for (size_t seed = 0; seed < count; ++seed) {
    if (is_seen[seed] || std::isnan(map->w[seed])) continue;
    patch.assign(1, seed);
    is_seen[seed] = 1;
    for (size_t i = 0; i < patch.size(); ++i) {
      const size_t at = patch[i], x = at % width;
      const auto visit = [&](size_t next) {
        if (is_seen[next] || !(std::abs(map->w[next] - map->w[at]) <= limit)) return;
        is_seen[next] = 1;
        patch.push_back(next);
      };
      if (x > 0) visit(at - 1);
      if (x + 1 < width) visit(at + 1);
      if (at >= width) visit(at - width);
      if (at + width < count) visit(at + width);
    }
    if (patch.size() >= pixels_min) continue;
    for (const size_t i : patch) map->w[i] = kUnknown;
  }
}

void FillFromBackground(float otherwise, InverseDepthMap* map) {
  const size_t width = map->width_px;
  const float* last = nullptr;
  std::vector<size_t> empty_above;
  for (size_t y = 0; y < map->height_px; ++y) {
    float* row = map->w.data() + y * width;
    if (FillRow(row, map->width_px)) {
      if (last == nullptr) {
        for (size_t above = 0; above < y; ++above)
          std::copy_n(row, width, map->w.data() + above * width);
      }
      last = row;
    } else if (last != nullptr) {
      std::copy_n(last, width, row);
    }
  }
  if (last == nullptr) std::fill(map->w.begin(), map->w.end(), otherwise);
}

InverseDepthMap SmoothBetweenEdges(const InverseDepthMap& map, double difference_max,
                                   ThreadPool& pool) {
  const InverseDepthMap median =
      Filter(map, pool, [&](int x, int y) { return MedianAround(map, x, y); });
  const float limit = static_cast<float>(difference_max);
  return Filter(median, pool, [&](int x, int y) { return MeanAround(median, x, y, limit); });
}

InverseDepthMap Enlarge(const InverseDepthMap& map, uint32_t width_px, uint32_t height_px) {
  InverseDepthMap out{width_px, height_px,
                      std::vector<float>(static_cast<size_t>(width_px) * height_px)};
  for (uint32_t y = 0; y < height_px; ++y) {
    const size_t row = static_cast<size_t>(std::min(y / 2, map.height_px - 1)) * map.width_px;
    for (uint32_t x = 0; x < width_px; ++x) {
      out.w[static_cast<size_t>(y) * width_px + x] = map.w[row + std::min(x / 2, map.width_px - 1)];
    }
  }
  return out;
}

}  // namespace veduta
