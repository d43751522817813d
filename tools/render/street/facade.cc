// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/facade.h"

#include <algorithm>
#include <cmath>

#include "tools/render/street/draws.h"
#include "tools/render/street/plan.h"

namespace veduta::street {
namespace {

constexpr double kHouseDepthM = 9;
constexpr double kInsetM = 0.02;
constexpr double kCornerInsetM = 0.6;  // more than any window's recess

uint32_t Seed32(SeededRandom& random) {
  return static_cast<uint32_t>(random.Next());
}

// What distinguishes a house, drawn once.
struct House {
  double width = 0, ground_height = 0, floor_height = 0;
  int bays = 1, floors = 3;
  double window_width = 0, recess = 0, sill_height = 0, window_height = 0;
  int door_bay = -1, balcony_column = -1;
  bool shop_sign = false, lintels = false, base_cornice = true;
  Finish wall, ground, trim, roof;

  double bay() const { return width / bays; }
  double FloorBase(int floor) const {
    return floor == 0 ? 0 : ground_height + (floor - 1) * floor_height;
  }
  double FloorTop(int floor) const { return FloorBase(floor + 1); }
  double height() const { return FloorBase(floors); }
};

Eigen::Vector3d WallTint(Material material, SeededRandom& random) {
  static const Eigen::Vector3d plasters[] = {{0.56, 0.50, 0.38}, {0.60, 0.56, 0.50},
                                             {0.55, 0.38, 0.28}, {0.42, 0.47, 0.42},
                                             {0.50, 0.44, 0.30}, {0.40, 0.44, 0.52}};
  static const Eigen::Vector3d bricks[] = {
      {0.42, 0.19, 0.13}, {0.48, 0.28, 0.17}, {0.36, 0.26, 0.21}, {0.50, 0.42, 0.30}};
  const Eigen::Vector3d base = material == Material::kBrick    ? bricks[random.Below(4)]
                               : material == Material::kAshlar ? Eigen::Vector3d(0.50, 0.47, 0.41)
                                                               : plasters[random.Below(6)];
  return base * Between(random, 0.82, 1.12);
}

House DrawHouse(double width, bool repeated, SeededRandom& random) {
  House house;
  house.width = width;
  house.floors = 3 + random.Below(3);
  house.ground_height = Between(random, 3.2, 3.9);
  house.floor_height = Between(random, 2.8, 3.3);
  house.bays = std::max(1, static_cast<int>(std::lround(width / Between(random, 2.3, 3.1))));
  house.window_width = house.bay() * Between(random, 0.40, 0.52);
  house.recess = Between(random, 0.14, 0.32);
  house.sill_height = Between(random, 0.6, 0.95);
  house.window_height = house.floor_height * Between(random, 0.48, 0.58);
  house.door_bay = repeated ? -1 : static_cast<int>(random.Below(house.bays));
  house.balcony_column = random.Unit() < 0.5 ? static_cast<int>(random.Below(house.bays)) : -1;
  house.shop_sign = !repeated && random.Unit() < 0.45;
  house.lintels = random.Unit() < 0.6;
  house.base_cornice = random.Unit() < 0.75;
  const uint32_t kind = random.Below(20);
  house.wall.material = kind < 9    ? Material::kPlaster
                        : kind < 17 ? Material::kBrick
                                    : Material::kAshlar;
  house.wall.tint = WallTint(house.wall.material, random);
  house.ground.material = random.Unit() < 0.5 ? Material::kAshlar : house.wall.material;
  house.ground.tint = house.ground.material == house.wall.material
                          ? house.wall.tint
                          : WallTint(Material::kAshlar, random);
  house.trim = {Material::kTrim, Eigen::Vector3d(0.60, 0.57, 0.50) * Between(random, 0.7, 1.15)};
  house.roof = {Material::kRoof, random.Unit() < 0.5 ? Eigen::Vector3d(0.38, 0.17, 0.11)
                                                     : Eigen::Vector3d(0.20, 0.21, 0.24)};
  return house;
}

// A hole in the wall: four reveals and what closes it. `base` lies at the hole's lower left corner.
void AddOpening(const WallFrame& base, double width, double height, double recess,
                const House& house, bool door, SeededRandom& random, QuadMesh& mesh) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), along = base.along, out = base.outward();
  const Finish reveal = {Material::kPlaster, house.trim.tint * 0.85};
  const auto face = [&](const Eigen::Vector3d& origin, const Eigen::Vector3d& u,
                        const Eigen::Vector3d& v, double s, double t) {
    mesh.AddRect(mesh.AddSurface(origin, u, v, reveal, Seed32(random), {s, t}, 0.8), 0, 0, s, t);
  };
  face(base.At(0, 0, 0), -out, up, recess, height);              // left
  face(base.At(width, -recess, 0), out, up, recess, height);     // right
  face(base.At(0, 0, 0), along, -out, width, recess);            // bottom
  face(base.At(0, -recess, height), along, out, width, recess);  // top
  Finish fill;
  if (door) {
    fill = {Material::kDoor, Between(random, {0.12, 0.1, 0.06}, {0.4, 0.26, 0.24})};
  } else {
    // Behind the glass: dark rooms, blinds and curtains of all colours.
    const double level =
        random.Unit() < 0.55 ? Between(random, 0.05, 0.14) : Between(random, 0.25, 0.5);
    fill = {Material::kWindow, level * Between(random, {0.8, 0.85, 0.85}, {1.1, 1.05, 1.25})};
  }
  mesh.AddRect(mesh.AddSurface(base.At(0, -recess, 0), along, up, fill, Seed32(random),
                               {width, height}, 0.9),
               0, 0, width, height);
}

void AddBalcony(const WallFrame& base, double width, const House& house, SeededRandom& random,
                QuadMesh& mesh) {
  const double depth = 0.75;
  mesh.AddBox(base.Moved(0, 0, -0.16), {width, depth, 0.16}, house.trim, random);
  const Finish iron = {Material::kPaint, Eigen::Vector3d(0.06, 0.065, 0.07)};
  mesh.AddBox(base.Moved(0.03, depth - 0.07, 0.92), {width - 0.06, 0.05, 0.05}, iron, random);
  const int bars = static_cast<int>(width / 0.16);
  for (int i = 0; i <= bars; ++i) {
    mesh.AddBox(base.Moved(0.03 + i * (width - 0.085) / bars, depth - 0.055, 0),
                {0.025, 0.025, 0.92}, iron, random);
  }
}

// The wall of one floor as strips between its openings. All floors of a house share the strips'
// edges, so the wall is watertight.
void AddFloorWall(const House& house, int floor, uint32_t surface, double opening_low,
                  double opening_high, QuadMesh& mesh) {
  const double base = house.FloorBase(floor), top = house.FloorTop(floor), bay = house.bay();
  const double gap = (bay - house.window_width) / 2;
  for (int b = 0; b < house.bays; ++b) {
    const double x0 = b * bay, x1 = x0 + gap, x2 = x1 + house.window_width,
                 x3 = b + 1 == house.bays ? house.width : (b + 1) * bay;
    const bool door = floor == 0 && b == house.door_bay;
    const double cuts[4] = {base, opening_low, opening_high, top};
    for (int r = 0; r < 3; ++r) {
      mesh.AddRect(surface, x0, cuts[r], x1, cuts[r + 1]);
      mesh.AddRect(surface, x2, cuts[r], x3, cuts[r + 1]);
      const bool open = r == 1 || (r == 0 && door);
      if (!open) mesh.AddRect(surface, x1, cuts[r], x2, cuts[r + 1]);
    }
  }
}

void AddFloor(const WallFrame& frame, const House& house, int floor, uint32_t surface,
              SeededRandom& random, QuadMesh& mesh) {
  const double base = house.FloorBase(floor), bay = house.bay(),
               gap = (bay - house.window_width) / 2;
  const double low = base + (floor == 0 ? 0.9 : house.sill_height);
  const double high = floor == 0 ? 2.45 : low + house.window_height;
  AddFloorWall(house, floor, surface, low, high, mesh);
  for (int b = 0; b < house.bays; ++b) {
    const bool door = floor == 0 && b == house.door_bay;
    const double x = b * bay + gap, bottom = door ? base : low;
    AddOpening(frame.Moved(x, 0, bottom), house.window_width, high - bottom, house.recess, house,
               door, random, mesh);
    const bool balcony = floor > 0 && b == house.balcony_column;
    if (balcony) {
      AddBalcony(frame.Moved(x - 0.25, 0, base + 0.25), house.window_width + 0.5, house, random,
                 mesh);
    } else if (!door) {
      mesh.AddBox(frame.Moved(x - 0.1, 0, low - 0.09), {house.window_width + 0.2, 0.12, 0.09},
                  house.trim, random);
    }
    if (house.lintels) {
      mesh.AddBox(frame.Moved(x - 0.13, 0, high + 0.02), {house.window_width + 0.26, 0.07, 0.2},
                  house.trim, random);
    }
  }
}

void AddShopSign(const WallFrame& frame, const House& house, SeededRandom& random, QuadMesh& mesh) {
  const double width = std::min(house.width - 0.8, Between(random, 2.5, 5.5)),
               height = Between(random, 0.42, 0.6);
  const double x = Between(random, 0.3, house.width - width - 0.3);
  const Finish finish = {Material::kPoster, Between(random, {0.2, 0.2, 0.15}, {0.8, 0.7, 0.7})};
  mesh.AddBox(frame.Moved(x, 0, house.ground_height - height - 0.1), {width, 0.14, height}, finish,
              random);
}

void AddPosters(const WallFrame& frame, const House& house, SeededRandom& random, QuadMesh& mesh) {
  const double pier = house.bay() - house.window_width;
  for (int b = 1; b < house.bays; ++b) {
    if (random.Unit() > 0.5) continue;
    const double width = std::min(pier - 0.35, Between(random, 0.5, 0.9)),
                 height = width * Between(random, 1.1, 1.6);
    if (width < 0.4) continue;
    const Finish finish = {Material::kPoster, Between(random, {0.35, 0.3, 0.2}, {0.9, 0.85, 0.8})};
    const WallFrame corner =
        frame.Moved(b * house.bay() - width / 2, 0.015, Between(random, 0.8, 1.2));
    mesh.AddRect(mesh.AddSurface(corner.origin, corner.along, Eigen::Vector3d::UnitZ(), finish,
                                 Seed32(random), {width, height}),
                 0, 0, width, height);
  }
}

// Side walls, the back and a mansard roof: what shows above lower neighbours and from corners.
//
// Walls stand back from the house's ends by `inset_left` and `inset_right`, so that no two houses'
// walls coincide.
void AddShell(const WallFrame& frame, const House& house, double inset_left, double inset_right,
              SeededRandom& random, QuadMesh& mesh) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), along = frame.along, out = frame.outward();
  const double h = house.height(), rise = 2.4, run = 1.5;
  const Finish side = {Material::kPlaster, house.wall.tint * 0.9};
  const uint32_t left =
      mesh.AddSurface(frame.At(inset_left, -kHouseDepthM, 0), out, up, side, Seed32(random));
  mesh.AddRect(left, 0, 0, kHouseDepthM, h);
  mesh.AddRect(left, 0, h, kHouseDepthM - run, h + rise);
  mesh.AddTriangle(left, {kHouseDepthM - run, h}, {kHouseDepthM, h},
                   {kHouseDepthM - run, h + rise});
  const uint32_t right =
      mesh.AddSurface(frame.At(house.width - inset_right, 0, 0), -out, up, side, Seed32(random));
  mesh.AddRect(right, 0, 0, kHouseDepthM, h);
  mesh.AddRect(right, run, h, kHouseDepthM, h + rise);
  mesh.AddTriangle(right, {0, h}, {run, h}, {run, h + rise});
  const uint32_t back = mesh.AddSurface(frame.At(house.width - inset_right, -kHouseDepthM, 0),
                                        -along, up, side, Seed32(random));
  mesh.AddRect(back, 0, 0, house.width - inset_left - inset_right, h + rise);
  const double slope = std::hypot(rise, run);
  const Eigen::Vector3d upslope = (rise * up - run * out) / slope;
  mesh.AddRect(mesh.AddSurface(frame.At(0, 0, h), along, upslope, house.roof, Seed32(random)), 0, 0,
               house.width, slope);
  mesh.AddRect(
      mesh.AddSurface(frame.At(0, -run, h + rise), along, -out, house.roof, Seed32(random)), 0, 0,
      house.width, kHouseDepthM - run);
}

// `signs` draws what hangs on the house, `random` everything else; they may be the same.
void AddHouse(const WallFrame& row, double width, double setback, bool first, bool last,
              bool repeated, SeededRandom& random, SeededRandom& signs, QuadMesh& mesh) {
  const House house = DrawHouse(width, repeated, random);
  const WallFrame frame = row.Moved(0, -setback, 0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const uint32_t ground =
      mesh.AddSurface(frame.origin, frame.along, up, house.ground, Seed32(random));
  const uint32_t wall = mesh.AddSurface(frame.origin, frame.along, up, house.wall, Seed32(random));
  for (int f = 0; f < house.floors; ++f)
    AddFloor(frame, house, f, f == 0 ? ground : wall, random, mesh);
  // Bands end short of the house's edges: no face lies in a neighbour's plane.
  const double end = repeated ? 0.0 : 0.015;
  const auto band = [&](double z, double out, double height) {
    mesh.AddBox(frame.Moved(end, 0, z), {width - 2 * end, out, height}, house.trim, random);
  };
  band(0, 0.06, 0.35);
  if (house.base_cornice && !house.shop_sign) band(house.ground_height - 0.12, 0.16, 0.24);
  band(house.height() - 0.35, 0.22, 0.18);
  band(house.height() - 0.17, 0.42, 0.17);
  if (!repeated) {
    if (house.shop_sign) AddShopSign(frame, house, signs, mesh);
    AddPosters(frame, house, signs, mesh);
  }
  // Around the corner the next row's windows reach into this house.
  AddShell(frame, house, first ? kCornerInsetM : kInsetM, last ? kCornerInsetM : kInsetM, random,
           mesh);
}

// What is left of a row of repeated bays: a plain wall.
void AddRemainder(const WallFrame& frame, double width, SeededRandom& random, QuadMesh& mesh) {
  House house = DrawHouse(width, true, random);
  mesh.AddRect(mesh.AddSurface(frame.origin, frame.along, Eigen::Vector3d::UnitZ(), house.wall,
                               Seed32(random)),
               0, 0, width, house.height());
  AddShell(frame, house, kInsetM, kInsetM, random, mesh);
}

// Houses from `from_m` to `to_m` of a row of `length_m`; `row` and `seed` belong to them.
void AddHouses(const WallFrame& frame, double from_m, double to_m, double length_m, uint64_t seed,
               bool repeated, SeededRandom& row, QuadMesh& mesh) {
  double at = from_m;
  while (to_m - at > 0.5) {
    const double left = to_m - at;
    double width = repeated ? kRepeatPeriodM : Between(row, 7, 15);
    if (!repeated && left - width < 7) width = left <= 15 ? left : left / 2;
    if (left < width) width = left;
    SeededRandom random(repeated ? MixSeed(seed, 2) : row.Next());
    const bool first = at == 0, last = length_m - at - width <= 0.5;
    const double setback =
        repeated || first || last ? 0 : Between(row, 0, 0.5);  // corners meet the next row's
    const WallFrame place = frame.Moved(at, 0, 0);
    if (width >= 1.5) {
      AddHouse(place, width, setback, first, last, repeated, random, random, mesh);
    } else {
      AddRemainder(place, width, random, mesh);
    }
    at += width;
  }
}

// Two houses where there is room for two. They are built at the origin and copied, so that nothing
// depends on where they stand but what `signs` draws. No setback: near a corner the next row's side
// wall would come through their windows.
void AddTwinHouses(const WallFrame& frame, const TwinHouses& twins, SeededRandom& signs,
                   QuadMesh& mesh) {
  SeededRandom row(twins.seed);
  const int count = twins.length_m < 14 ? 1 : 2;
  const double first = count == 1 ? twins.length_m : twins.length_m * Between(row, 0.47, 0.53);
  QuadMesh part;
  for (int i = 0; i < count; ++i) {
    SeededRandom random(row.Next());
    AddHouse(WallFrame().Moved(i * first, 0, 0), i == 0 ? first : twins.length_m - first, 0, false,
             false, false, random, signs, part);
  }
  mesh.AddCopy(part, frame.Moved(twins.from_m, 0, 0));
}

}  // namespace

void AddHouseRow(const WallFrame& frame, double length_m, uint64_t seed, bool repeated,
                 std::span<const TwinHouses> twins, QuadMesh& mesh) {
  SeededRandom row(MixSeed(seed, 1));
  double at = 0;
  for (const TwinHouses& place : twins) {
    AddHouses(frame, at, place.from_m, length_m, seed, repeated, row, mesh);
    SeededRandom signs(row.Next());
    AddTwinHouses(frame, place, signs, mesh);
    at = place.from_m + place.length_m;
  }
  AddHouses(frame, at, length_m, length_m, seed, repeated, row, mesh);
}

}  // namespace veduta::street
