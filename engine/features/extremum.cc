// SPDX-License-Identifier: Apache-2.0
#include "engine/features/extremum.h"

#include <cmath>

namespace veduta {
namespace {

// The 3 x 3 x 3 differences about a sample, in units of the stored grey values.
struct Neighborhood {
  double d[3][3][3];  // level, row, column
};

Neighborhood ReadNeighborhood(const OctaveRows& octave, int level, int y, int x) {
  Neighborhood n;
  for (int row = 0; row < 3; ++row) {
    const int16_t* g[4];
    for (int i = 0; i < 4; ++i) g[i] = octave.levels[level - 1 + i].Row(y - 1 + row) + x - 1;
    for (int i = 0; i < 3; ++i) {
      for (int column = 0; column < 3; ++column) n.d[i][row][column] = g[i + 1][column] - g[i][column];
    }
  }
  return n;
}

struct Quadric {
  double gx, gy, gs;                      // gradient at the middle
  double hxx, hyy, hss, hxy, hxs, hys;    // Hessian
  double ox, oy, os;                      // offset of the extremum from the middle
  bool regular = false;
};

Quadric FitQuadric(const Neighborhood& n) {
  const auto& d = n.d;
  Quadric q;
  q.gx = 0.5 * (d[1][1][2] - d[1][1][0]);
  q.gy = 0.5 * (d[1][2][1] - d[1][0][1]);
  q.gs = 0.5 * (d[2][1][1] - d[0][1][1]);
  const double twice = 2 * d[1][1][1];
  q.hxx = d[1][1][2] + d[1][1][0] - twice;
  q.hyy = d[1][2][1] + d[1][0][1] - twice;
  q.hss = d[2][1][1] + d[0][1][1] - twice;
  q.hxy = 0.25 * (d[1][2][2] - d[1][2][0] - d[1][0][2] + d[1][0][0]);
  q.hxs = 0.25 * (d[2][1][2] - d[2][1][0] - d[0][1][2] + d[0][1][0]);
  q.hys = 0.25 * (d[2][2][1] - d[2][0][1] - d[0][2][1] + d[0][0][1]);
  // offset = -H^-1 g by cofactors; the entries are integers / 4, so a determinant of nothing is exactly 0.
  const double cxx = q.hyy * q.hss - q.hys * q.hys;
  const double cxy = q.hxs * q.hys - q.hxy * q.hss;
  const double cxs = q.hxy * q.hys - q.hxs * q.hyy;
  const double determinant = q.hxx * cxx + q.hxy * cxy + q.hxs * cxs;
  if (determinant == 0) return q;
  const double cyy = q.hxx * q.hss - q.hxs * q.hxs;
  const double cys = q.hxy * q.hxs - q.hxx * q.hys;
  const double css = q.hxx * q.hyy - q.hxy * q.hxy;
  q.ox = -(cxx * q.gx + cxy * q.gy + cxs * q.gs) / determinant;
  q.oy = -(cxy * q.gx + cyy * q.gy + cys * q.gs) / determinant;
  q.os = -(cxs * q.gx + cys * q.gy + css * q.gs) / determinant;
  q.regular = true;
  return q;
}

int StepOf(double offset) { return offset > 0.5 ? 1 : offset < -0.5 ? -1 : 0; }

}  // namespace

std::optional<Extremum> RefineExtremum(const OctaveRows& octave, int level, int y, int x,
                                       const ExtremumLimits& limits) {
  for (int step = 0; step < kRefineSteps; ++step) {
    const Neighborhood n = ReadNeighborhood(octave, level, y, x);
    const Quadric q = FitQuadric(n);
    if (!q.regular) return std::nullopt;
    const int sx = StepOf(q.ox), sy = StepOf(q.oy), ss = StepOf(q.os);
    if (sx == 0 && sy == 0 && ss == 0) {
      const double value = n.d[1][1][1] + 0.5 * (q.gx * q.ox + q.gy * q.oy + q.gs * q.os);
      const double contrast = value / (kGrayUnit * 255.0);
      if (std::fabs(contrast) < limits.contrast_min) return std::nullopt;
      const double trace = q.hxx + q.hyy, determinant = q.hxx * q.hyy - q.hxy * q.hxy;
      const double r = limits.edge_ratio_max;
      if (determinant <= 0 || trace * trace * r >= (r + 1) * (r + 1) * determinant) return std::nullopt;
      Extremum result;
      result.level = level;
      result.column = x;
      result.row = y;
      result.x = x + q.ox;
      result.y = y + q.oy;
      result.level_offset = q.os;
      result.contrast = contrast;
      return result;
    }
    // A step is a sample wide at most, so that the rows read stay within kRefineReach.
    x += sx;
    y += sy;
    level += ss;
    if (level < 1 || level > kScalesPerOctave || x < kExtremumBorder || x >= octave.width - kExtremumBorder || y < kExtremumBorder ||
        y >= octave.height - kExtremumBorder) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace veduta
