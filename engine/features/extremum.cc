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
      for (int column = 0; column < 3; ++column)
        n.d[i][row][column] = g[i + 1][column] - g[i][column];
    }
  }
  return n;
}

struct Quadric {
  double gx, gy, gs;                    // gradient at the middle
  double hxx, hyy, hss, hxy, hxs, hys;  // Hessian
  double ox, oy, os;                    // offset of the extremum from the middle
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
  // offset = -H^-1 g by cofactors; the entries are integers / 4, so a determinant of nothing is
  // exactly 0.
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

// Places the extremum in the image at the scale that the quadric gave. A quadric about the middle
// takes the curvature of the middle's scale; over half a level it changes by a tenth, and so would
// the offset. The differences at the scale in between come from a parabola through the three
// levels, the extremum from a paraboloid through those, whose derivatives along an axis are
// averaged over the three lines with weights 1 : 4 : 1.
void PlaceAtItsScale(const Neighborhood& n, Quadric* q) {
  double m[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double below = n.d[0][i][j], middle = n.d[1][i][j], above = n.d[2][i][j];
      m[i][j] = middle + 0.5 * q->os * ((above - below) + q->os * (above + below - 2 * middle));
    }
  }
  double px[3], py[3];
  for (int k = 0; k < 3; ++k) {
    px[k] = (m[0][k] + 4 * m[1][k] + m[2][k]) / 6;
    py[k] = (m[k][0] + 4 * m[k][1] + m[k][2]) / 6;
  }
  const double gx = 0.5 * (px[2] - px[0]), gy = 0.5 * (py[2] - py[0]);
  const double hxx = px[2] + px[0] - 2 * px[1], hyy = py[2] + py[0] - 2 * py[1];
  const double hxy = 0.25 * (m[2][2] - m[2][0] - m[0][2] + m[0][0]);
  const double determinant = hxx * hyy - hxy * hxy;
  if (determinant <= 0) return;
  const double ox = (hxy * gy - hyy * gx) / determinant, oy = (hxy * gx - hxx * gy) / determinant;
  if (std::fabs(ox) > 1 || std::fabs(oy) > 1) return;
  q->ox = ox;
  q->oy = oy;
}

// Above a half: with a half, an extremum midway between two samples would send the search to and
// fro until it ran out of steps. This saves a tenth of all features.
constexpr double kStepOffset = 0.6;

int StepOf(double offset) {
  return offset > kStepOffset ? 1 : offset < -kStepOffset ? -1 : 0;
}

}  // namespace

std::optional<Extremum> RefineExtremum(const OctaveRows& octave, int level, int y, int x,
                                       const ExtremumLimits& limits) {
  for (int step = 0; step < kRefineSteps; ++step) {
    const Neighborhood n = ReadNeighborhood(octave, level, y, x);
    Quadric q = FitQuadric(n);
    if (!q.regular) return std::nullopt;
    const int sx = StepOf(q.ox), sy = StepOf(q.oy), ss = StepOf(q.os);
    if (sx == 0 && sy == 0 && ss == 0) {
      const double value = n.d[1][1][1] + 0.5 * (q.gx * q.ox + q.gy * q.oy + q.gs * q.os);
      const double contrast = value / (kGrayUnit * 255.0);
      if (std::fabs(contrast) < limits.contrast_min) return std::nullopt;
      const double trace = q.hxx + q.hyy, determinant = q.hxx * q.hyy - q.hxy * q.hxy;
      const double r = limits.edge_ratio_max;
      if (determinant <= 0 || trace * trace * r >= (r + 1) * (r + 1) * determinant)
        return std::nullopt;
      PlaceAtItsScale(n, &q);
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
    if (level < 1 || level > kScalesPerOctave || x < kExtremumBorder ||
        x >= octave.width - kExtremumBorder || y < kExtremumBorder ||
        y >= octave.height - kExtremumBorder) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace veduta
