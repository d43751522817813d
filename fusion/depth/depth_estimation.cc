// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/depth_estimation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "fusion/depth/inverse_depth_map.h"
#include "fusion/depth/sweep_geometry.h"
#include "fusion/depth/view_pyramid.h"
#include "kernels/scanline.h"

namespace veduta {
namespace {
double Env(const char* n, double d) {
  const char* v = std::getenv(n);
  return v ? atof(v) : d;
}

struct Level {
  View key;
  std::vector<View> sensors;
  double pixels_per_inverse_depth = 0;
};

ScanlineOptions Scan(bool refine) {
  ScanlineOptions o;
  o.penalty_small = (uint8_t)(refine ? Env("RP1", 10) : Env("P1", 16));
  double p2min = refine ? Env("RP2MIN", 24) : Env("P2MIN", 40), p2max = refine ? Env("RP2", 90) : Env("P2", 110),
         t = Env("P2T", 8);
  for (int g = 0; g < 256; ++g)
    o.penalty_large[(size_t)g] = (uint8_t)std::min(128.0, p2min + (p2max - p2min) * t / (t + g));
  return o;
}

SweepProblem Problem(const Level& level, const PlaneSpacing& planes) {
  SweepProblem p;
  p.key = {level.key.geometry.width_px, level.key.geometry.height_px, level.key.gray.data()};
  for (const View& s : level.sensors) {
    const SweepGeometry g(level.key.geometry, s.geometry);
    SweepSensor out;
    out.image = {s.geometry.width_px, s.geometry.height_px, s.gray.data()};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) out.rotation[(size_t)(3 * r + c)] = (float)g.rotation(r, c);
      out.translation[(size_t)r] = (float)g.translation(r);
    }
    p.sensors.push_back(out);
  }
  p.first = (float)planes.first;
  p.step = (float)planes.step;
  p.plane_count = planes.count;
  return p;
}
}  // namespace

Status DepthOptions::Check() const {
  return Status::Ok();
}

Result<DepthMap> EstimateDepth(const View& key, std::span<const View> sensors, const DepthRange& range,
                               const DepthOptions& options, Device* device, ThreadPool& pool) {
  const double first = 1 / range.far, last = 1 / range.near;
  std::vector<Level> levels(1);
  levels[0].key = key;
  levels[0].sensors.assign(sensors.begin(), sensors.end());
  const auto spacing = [&](Level& l) {
    std::vector<ViewGeometry> g;
    for (auto& s : l.sensors) g.push_back(s.geometry);
    l.pixels_per_inverse_depth = PixelsPerInverseDepth(l.key.geometry, g, first, last);
    return SpacePlanes(first, last, l.pixels_per_inverse_depth, options.plane_step_px, options.plane_count_max);
  };
  PlaneSpacing planes = spacing(levels[0]);
  while ((double)levels.back().key.gray.size() * PlaneStride(planes.count) * 3 > (double)options.volume_bytes_max ||
         (Env("LEVELS", 0) >= (double)levels.size())) {
    Level half;
    half.key = HalveView(levels.back().key);
    for (auto& s : levels.back().sensors) half.sensors.push_back(HalveView(s));
    levels.push_back(half);
    planes = spacing(levels.back());
  }
  InverseDepthMap map;
  for (size_t l = levels.size(); l-- > 0;) {
    const Level& level = levels[l];
    const uint32_t w = level.key.geometry.width_px, h = level.key.geometry.height_px;
    const double px = 1 / level.pixels_per_inverse_depth;
    if (l + 1 == levels.size()) {
      const SweepProblem p = Problem(level, planes);
      VEDUTA_ASSIGN_OR_RETURN(const PlaneChoice c, SweepAndChoose(p, Scan(false), device, pool));
      map = RefineBetweenPlanes(c, w, h, p.base, planes);
    } else {
      map = Enlarge(map, w, h);
    }
    const int count = l == 0 ? (int)Env("REFINE", options.refinement_count) : 1;
    for (int r = 0; r < count; ++r) {
      RemoveSpeckles(px * Env("SPX", 1.0), (uint32_t)Env("SPN", 40), &map);
      FillFromBackground((float)first, &map);
      map = SmoothBetweenEdges(map, px * Env("SMX", 1.0), pool);
      const double step = px * Env("RSTEP", 0.25);
      const uint32_t n = (uint32_t)Env("RN", 16);
      PlaneSpacing around{-step * (n / 2), step, n};
      SweepProblem p = Problem(level, around);
      p.base.resize(map.w.size());
      for (size_t i = 0; i < map.w.size(); ++i) p.base[i] = map.w[i] + (float)around.first;
      VEDUTA_ASSIGN_OR_RETURN(const PlaneChoice c, SweepAndChoose(p, Scan(true), device, pool));
      map = RefineBetweenPlanes(c, w, h, p.base, around);
    }
  }
  const double px = 1 / levels[0].pixels_per_inverse_depth;
  if (Env("FSM", 0) > 0) map = SmoothBetweenEdges(map, px * Env("SMX", 1.0), pool);
  RemoveSpeckles(px * Env("SPX", 1.0), (uint32_t)Env("FSPN", 40), &map);
  DepthMap out{map.width_px, map.height_px, std::vector<float>(map.w.size()), std::vector<uint8_t>(map.w.size())};
  for (size_t i = 0; i < map.w.size(); ++i) {
    if (std::isnan(map.w[i]) || map.w[i] <= 0) continue;
    out.depth[i] = 1 / map.w[i];
    out.confidence[i] = 255;
  }
  return out;
}

}  // namespace veduta
