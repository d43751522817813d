// SPDX-License-Identifier: Apache-2.0
// Floors to lay sheets on: each a formula of the place, with hashed numbers where nature is random.
#include <algorithm>
#include <cmath>

#include "storage/base/content_hash.h"
#include "tools/floor/floor.h"

namespace veduta::floor {
namespace {

// In [0, 1), the same for the same cell.
double CellNumber(int64_t i, int64_t j, uint64_t seed) {
  const uint64_t mixed = MixSeed(MixSeed(seed, static_cast<uint64_t>(i)), static_cast<uint64_t>(j));
  return static_cast<double>(mixed >> 11) * 0x1.0p-53;
}

double Fraction(double x) {
  return x - std::floor(x);
}

int64_t Cell(double x) {
  return static_cast<int64_t>(std::floor(x));
}

// Planks of 12 cm by 90 cm with a grain along them and dark joints.
double Wood(double x, double y, uint64_t seed) {
  const int64_t row = Cell(y / 0.12);
  const double along = x / 0.9 + CellNumber(row, 1, seed);
  const int64_t plank = Cell(along);
  const double tone = CellNumber(row, 100 + plank, seed);
  const double across_m = Fraction(y / 0.12) * 0.12, along_m = Fraction(along) * 0.9;
  if (across_m < 0.0015 || along_m < 0.0015) return 0.06;
  const double wave = std::sin(260 * y + 3 * std::sin(5 * x + 20 * tone) + 40 * tone);
  const double fine = std::sin(1900 * y + 9 * std::sin(11 * x + 50 * tone));
  return 0.22 + 0.14 * tone + 0.04 * wave + 0.02 * fine;
}

// Tiles of 25 cm, each its own grey, with bright joints of 4 mm.
double Tile(double x, double y, uint64_t seed) {
  const double u = Fraction(x / 0.25) * 0.25, v = Fraction(y / 0.25) * 0.25;
  if (u < 0.004 || v < 0.004) return 0.7;
  return 0.12 + 0.25 * CellNumber(Cell(x / 0.25), Cell(y / 0.25), seed) +
         0.03 * std::sin(90 * x) * std::sin(70 * y);
}

// Round pebbles up to 6 cm across, at most one in each cell of 7 cm, dark or bright, some of them
// rings.
double Terrazzo(double x, double y, uint64_t seed) {
  constexpr double kCellM = 0.07;
  const int64_t i = Cell(x / kCellM), j = Cell(y / kCellM);
  const double radius = 0.012 + 0.018 * CellNumber(i, j, seed);
  const double room = kCellM - 2 * radius;
  const double cx = i * kCellM + radius + room * CellNumber(i, j, seed + 1);
  const double cy = j * kCellM + radius + room * CellNumber(i, j, seed + 2);
  const double distance = std::hypot(x - cx, y - cy) / radius;
  const double kind = CellNumber(i, j, seed + 3);
  const bool is_dark = kind < 0.6 ? distance < 1 : kind < 0.8 && distance < 1 && distance > 0.6;
  if (is_dark) return 0.08;
  return kind >= 0.8 && distance < 1 ? 0.75 : 0.42;
}

}  // namespace

std::vector<std::string_view> FlooringNames() {
  return {"plain", "wood", "tile", "terrazzo"};
}

float FlooringReflectance(Flooring flooring, const Eigen::Vector2d& place_m, uint64_t seed) {
  const double x = std::clamp(place_m.x(), -1e4, 1e4), y = std::clamp(place_m.y(), -1e4, 1e4);
  switch (flooring) {
    case Flooring::kPlain:
      return 0.35f;
    case Flooring::kWood:
      return static_cast<float>(Wood(x, y, seed));
    case Flooring::kTile:
      return static_cast<float>(Tile(x, y, seed));
    case Flooring::kTerrazzo:
      return static_cast<float>(Terrazzo(x, y, seed));
  }
  return 0;
}

}  // namespace veduta::floor
