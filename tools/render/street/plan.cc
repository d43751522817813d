// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/plan.h"

#include <algorithm>
#include <cmath>

#include "tools/render/street/twin_facades.h"

namespace veduta::street {
namespace {

constexpr double kDepthM = 12;   // of a row of houses
constexpr double kMarginM = 15;  // of houses beyond the ends of the street
constexpr double kHalf = kStreetWidthM / 2;

// Four rows of houses around [low, high] that look inwards, so that no view ends in the open.
void AddEnclosure(const Eigen::Vector2d& low, const Eigen::Vector2d& high, Plan& plan) {
  plan.blocks.push_back({{low.x(), high.y()}, {high.x(), high.y() + kDepthM}, kSouth});
  plan.blocks.push_back({{low.x(), low.y() - kDepthM}, {high.x(), low.y()}, kNorth});
  plan.blocks.push_back(
      {{high.x(), low.y() - kDepthM}, {high.x() + kDepthM, high.y() + kDepthM}, kWest});
  plan.blocks.push_back(
      {{low.x() - kDepthM, low.y() - kDepthM}, {low.x(), high.y() + kDepthM}, kEast});
  plan.low = low.array() - kDepthM;
  plan.high = high.array() + kDepthM;
}

Plan MakeStreet(double length) {
  Plan plan;
  const double from = -kMarginM, to = length + kMarginM;
  plan.blocks.push_back({{from, kHalf}, {to, kHalf + kDepthM}, kSouth | kEast | kWest});
  plan.blocks.push_back({{from, -kHalf - kDepthM}, {to, -kHalf}, kNorth | kEast | kWest});
  AddEnclosure({from - kStreetWidthM, -kHalf - kDepthM}, {to + kStreetWidthM, kHalf + kDepthM},
               plan);
  plan.lanes.push_back({{0, 0}, {length, 0}});
  return plan;
}

// count x count crossing streets `pitch` apart, blocks between and around them.
Plan MakeGrid(int count, double pitch) {
  Plan plan;
  for (int j = 0; j <= count; ++j) {
    for (int i = 0; i <= count; ++i) {
      const Eigen::Vector2d low((i - 1) * pitch + kHalf, (j - 1) * pitch + kHalf);
      plan.blocks.push_back({low, low.array() + (pitch - kStreetWidthM), kAllSides});
    }
  }
  const double edge = pitch - kHalf + kStreetWidthM;
  AddEnclosure(Eigen::Vector2d::Constant(-edge),
               Eigen::Vector2d::Constant((count - 1) * pitch + edge), plan);
  const double from = -pitch / 2, to = (count - 0.5) * pitch;
  for (int j = 0; j < count; ++j) plan.lanes.push_back({{from, j * pitch}, {to, j * pitch}});
  for (int i = 0; i < count; ++i) plan.lanes.push_back({{i * pitch, from}, {i * pitch, to}});
  return plan;
}

Plan MakeRing(double length) {
  const double pitch = RingPitch(length);
  Plan plan = MakeGrid(2, pitch);
  plan.lanes = {{{0, 0}, {pitch, 0}},
                {{pitch, 0}, {pitch, pitch}},
                {{pitch, pitch}, {0, pitch}},
                {{0, pitch}, {0, 0}}};
  return plan;
}

Plan MakeSquare(double length) {
  Plan plan;
  const double radius = std::max(length / 6.2831853, 12.0);
  const double half = std::max(4.5, std::min(0.45 * radius, radius - 11.0));
  plan.blocks.push_back(
      {Eigen::Vector2d::Constant(-half), Eigen::Vector2d::Constant(half), kAllSides});
  AddEnclosure(Eigen::Vector2d::Constant(-radius - 8), Eigen::Vector2d::Constant(radius + 8), plan);
  plan.lanes.push_back({{radius, 0}, {radius, 0}});
  return plan;
}

}  // namespace

Status SceneOptions::Check() const {
  if (!(length_m >= 10 && length_m <= 20000)) {
    return Status::InvalidArgument("length " + std::to_string(length_m) +
                                   " m is outside [10, 20000]");
  }
  if (build_threads < 1 || build_threads > 256) {
    return Status::InvalidArgument("threads " + std::to_string(build_threads) +
                                   " is outside [1, 256]");
  }
  return CheckTwinFacades(*this);
}

double RingPitch(double length_m) {
  return std::max(length_m / 4, kStreetWidthM + 10);
}

BlockEdge EdgeOf(const Block& block, int side) {
  const Eigen::Vector2d size = block.high - block.low;
  switch (side) {
    case 0:
      return {block.low, {1, 0}, size.x()};
    case 1:
      return {{block.high.x(), block.low.y()}, {0, 1}, size.y()};
    case 2:
      return {block.high, {-1, 0}, size.x()};
    default:
      return {{block.low.x(), block.high.y()}, {0, -1}, size.y()};
  }
}

namespace {

Plan MakeLayout(const SceneOptions& options) {
  switch (options.layout) {
    case Layout::kStreet:
      return MakeStreet(options.length_m);
    case Layout::kGrid: {
      const int count = std::max(
          1, static_cast<int>(std::ceil(std::sqrt(options.length_m / (2 * kBlockPitchM)))));
      return MakeGrid(count, kBlockPitchM);
    }
    case Layout::kRing:
      return MakeRing(options.length_m);
    case Layout::kSquare:
      return MakeSquare(options.length_m);
  }
  return {};
}

}  // namespace

Plan MakePlan(const SceneOptions& options) {
  Plan plan = MakeLayout(options);
  plan.twins = PlaceTwins(options, plan);
  return plan;
}

}  // namespace veduta::street
