// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where streets run and where houses stand, seen from above.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"

namespace veduta::street {

inline constexpr double kStreetWidthM = 14.0;   // from facade to facade
inline constexpr double kPavementWidthM = 2.5;  // on each side
inline constexpr double kRepeatPeriodM =
    3.0;  // with SceneOptions::repeated_windows the facade repeats after this
inline constexpr double kBlockPitchM = 60.0;  // of the grid, street included

enum class Layout : uint8_t {
  kStreet,  // one street along +x from the origin, closed at both ends by houses across
  kGrid,    // crossing streets, kBlockPitchM apart
  kRing,    // streets around one block of houses
  kSquare,  // one house on a square
};

// Distinct places whose facades are exactly alike: the same houses, windows and textures, lit the
// same. Signs, posters, trees, cars, pavements and neighbours differ.
enum class TwinFacades : uint8_t {
  kNone,
  kNear,  // two places of one row of houses, one house between them
  kFar,   // far from each other: no photo shows both
  kEnds,  // where a loop begins and before it ends
};

struct SceneOptions {
  uint64_t seed = 1;
  Layout layout = Layout::kStreet;
  double length_m =
      60;  // [10, 20000]; of all streets together, the ring's round trip, the square's orbit
  bool repeated_windows = false;  // every bay of every facade looks the same: perceptual aliasing
  TwinFacades twin_facades = TwinFacades::kNone;  // kStreet, kGrid, kRing; long enough for them
  uint32_t build_threads = 1;  // [1, 256]; of Embree's hierarchy; the pictures do not depend on it

  Status Check() const;
};

enum Side : uint8_t { kSouth = 1, kEast = 2, kNorth = 4, kWest = 8, kAllSides = 15 };

// A rectangle of houses; `sides` tells which of its edges carry facades that anyone sees.
struct Block {
  Eigen::Vector2d low, high;
  uint8_t sides = kAllSides;
};

struct Lane {
  Eigen::Vector2d from, to;  // the middle of the road
};

// One edge of a block, from left to right as seen from outside.
struct BlockEdge {
  Eigen::Vector2d from, along;  // `along` is a unit vector
  double length_m = 0;
};

// Edge `side` (0 south, 1 east, 2 north, 3 west) of a block.
BlockEdge EdgeOf(const Block& block, int side);

// A stretch of an edge whose houses have twins elsewhere.
struct TwinPlace {
  size_t block = 0;  // index in Plan::blocks
  int side = 0;      // of EdgeOf
  double from_m = 0, length_m = 0;
  uint32_t pair = 0;  // two places of one pair have the same facades
};

struct Plan {
  std::vector<Block> blocks;
  std::vector<Lane> lanes;
  std::vector<TwinPlace> twins;
  Eigen::Vector2d low, high;  // extent of the ground
};

// From the middle of one street of the ring to the middle of the next one.
double RingPitch(double length_m);

// Deterministic; `options` must pass Check().
Plan MakePlan(const SceneOptions& options);

}  // namespace veduta::street
