// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/twin_facades.h"

#include <algorithm>
#include <string>

namespace veduta::street {
namespace {

// A photographer stands 9 m from a facade, and a photo of the default focal length then shows 10 m
// of it: some photos of a place show nothing of its neighbours.
constexpr double kLengthM = 15;
constexpr double kShortestM = 8;  // one house
constexpr double kNearGapM = 8;   // one house between twins that are near each other
constexpr double kFarGapM = 40;   // between twins that are far from each other
constexpr double kCornerM = 2.5;  // from the corner of a block: a narrow house

// The blocks of MakeStreet, and those of MakeGrid(2, pitch) around the one that the loop goes
// around.
constexpr size_t kNorthRow = 0, kSouthRow = 1;
constexpr size_t kBelow = 1, kLeft = 3, kRight = 5, kAbove = 7;
// Numbers of the sides, as the bits of Side.
constexpr int kFacesSouth = 0, kFacesEast = 1, kFacesNorth = 2, kFacesWest = 3;

double RingEdge(double length_m) {
  return RingPitch(length_m) - kStreetWidthM;
}

// How long each place of a pair is on an edge of the loop.
double RingTwinLength(TwinFacades twins, double edge) {
  const double room =
      twins == TwinFacades::kNear ? (edge - kNearGapM) / 2 - kCornerM : edge - 2 * kCornerM;
  return std::min(kLengthM, room);
}

double StreetLengthMin(TwinFacades twins) {
  return 2 * kLengthM + (twins == TwinFacades::kNear ? kNearGapM : kFarGapM);
}

void AddPair(size_t block_a, int side_a, double from_a, size_t block_b, int side_b, double from_b,
             double length, std::vector<TwinPlace>& places) {
  const uint32_t pair = static_cast<uint32_t>(places.size() / 2);
  places.push_back({block_a, side_a, from_a, length, pair});
  places.push_back({block_b, side_b, from_b, length, pair});
}

// One pair in each row of houses. Rows begin `margin` before the walk does.
std::vector<TwinPlace> PlaceInStreet(TwinFacades twins, double length, double margin) {
  std::vector<TwinPlace> places;
  const double apart = twins == TwinFacades::kNear ? kNearGapM : length - 2 * kLengthM;
  const double first = margin + (length - apart) / 2 - kLengthM;
  for (const size_t row : {kNorthRow, kSouthRow}) {
    const int side = row == kNorthRow ? kFacesSouth : kFacesNorth;
    AddPair(row, side, first, row, side, first + kLengthM + apart, kLengthM, places);
  }
  return places;
}

std::vector<TwinPlace> PlaceInGrid(TwinFacades twins, const Plan& plan) {
  std::vector<TwinPlace> places;
  const size_t count = plan.lanes.size() / 2;
  // Blocks (1, 1) and (count, count) of the rows of count + 1 blocks.
  const size_t low = count + 2, high = count * (count + 1) + count;
  const double from = 4;  // the middle of an edge of 46 m holds two places and what lies between
  if (twins == TwinFacades::kNear) {
    AddPair(low, kFacesSouth, from, low, kFacesSouth, from + kLengthM + kNearGapM, kLengthM,
            places);
  } else {
    AddPair(low, kFacesSouth, from, high, kFacesSouth, from, kLengthM, places);
  }
  return places;
}

// The walk passes each face from its right end to its left end, where the edge's metres begin.
std::vector<TwinPlace> PlaceInRing(TwinFacades twins, double edge) {
  std::vector<TwinPlace> places;
  const double length = RingTwinLength(twins, edge), middle = (edge - length) / 2;
  switch (twins) {
    case TwinFacades::kNone:
      break;
    case TwinFacades::kNear: {
      const double first = (edge - kNearGapM) / 2 - length, second = (edge + kNearGapM) / 2;
      AddPair(kRight, kFacesWest, first, kRight, kFacesWest, second, length, places);
      AddPair(kLeft, kFacesEast, first, kLeft, kFacesEast, second, length, places);
      break;
    }
    case TwinFacades::kFar:
      AddPair(kBelow, kFacesNorth, middle, kAbove, kFacesSouth, middle, length, places);
      AddPair(kRight, kFacesWest, middle, kLeft, kFacesEast, middle, length, places);
      break;
    case TwinFacades::kEnds:
      AddPair(kBelow, kFacesNorth, edge - kCornerM - length, kLeft, kFacesEast, kCornerM, length,
              places);
      break;
  }
  return places;
}

}  // namespace

Status CheckTwinFacades(const SceneOptions& options) {
  if (options.twin_facades == TwinFacades::kNone) return {};
  if (options.repeated_windows)
    return Status::InvalidArgument("facades either repeat everywhere or have twins, not both");
  if (options.layout == Layout::kSquare)
    return Status::InvalidArgument("twin facades need a street or a loop, not one house");
  const bool ring = options.layout == Layout::kRing;
  if (!ring && options.twin_facades == TwinFacades::kEnds)
    return Status::InvalidArgument("twin facades at the ends need a loop");
  if (options.layout == Layout::kGrid && options.length_m < 2 * kBlockPitchM + 1)
    return Status::InvalidArgument("twin facades need a grid of at least two streets each way");
  double length_min = options.layout == Layout::kStreet ? StreetLengthMin(options.twin_facades) : 0;
  if (ring) {
    const double room = options.twin_facades == TwinFacades::kNear
                            ? 2 * (kShortestM + kCornerM) + kNearGapM
                            : kShortestM + 2 * kCornerM;
    length_min = 4 * (room + kStreetWidthM);
  }
  if (options.length_m < length_min) {
    return Status::InvalidArgument("twin facades need " + std::to_string(length_min) +
                                   " m of street here, not " + std::to_string(options.length_m));
  }
  return {};
}

std::vector<TwinPlace> PlaceTwins(const SceneOptions& options, const Plan& plan) {
  if (options.twin_facades == TwinFacades::kNone) return {};
  switch (options.layout) {
    case Layout::kStreet: {
      const double margin = plan.lanes[0].from.x() - plan.blocks[kNorthRow].low.x();
      return PlaceInStreet(options.twin_facades, options.length_m, margin);
    }
    case Layout::kGrid:
      return PlaceInGrid(options.twin_facades, plan);
    case Layout::kRing:
      return PlaceInRing(options.twin_facades, RingEdge(options.length_m));
    case Layout::kSquare:
      break;
  }
  return {};
}

Eigen::Vector2d MiddleOf(const TwinPlace& place, const Plan& plan) {
  const BlockEdge edge = EdgeOf(plan.blocks[place.block], place.side);
  return edge.from + (place.from_m + place.length_m / 2) * edge.along;
}

}  // namespace veduta::street
