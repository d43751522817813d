// SPDX-License-Identifier: Apache-2.0
// Goal: fused surfaces are where the shapes are, closed and turned outwards, better than
//   averages under noise and wrong depths; the same from any start, at any number of threads,
//   and wherever the tiles' borders lie.
// Method: maps of a sphere across eight tiles, exact and noisy, and of a wall, whose volume is
//   fused a second time with the borders moved by half a tile.
#include "fusion/volume/solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/device.h"
#include "storage/base/content_hash.h"
#include "tests/fusion/volume/small_volume.h"
#include "tests/fusion/volume/synthetic_maps.h"

namespace veduta {
namespace {

const VolumeGrid kGrid = {0.05, 4};
const synthetic::Shapes kBall = {{0.03, -0.02, 0.01}, 0.6, std::nullopt};
constexpr double kNoise = 0.01, kOutliers = 0.1;  // 0.6 voxels at a distance of 3 m

std::vector<RangeImage> BallImages(double noise, double outliers) {
  std::vector<RangeImage> images;
  for (const ViewGeometry& view : synthetic::ViewsAround(kBall.center, 3, 128)) {
    images.push_back(
        RangeImage::Make(synthetic::Render(kBall, view, noise, outliers, images.size()), view)
            .value());
  }
  return images;
}

SmallVolume BallVolume(double noise, double outliers) {
  SmallVolume volume;
  volume.grid = kGrid;
  volume.Integrate(BallImages(noise, outliers), 8);
  return volume;
}

double DistanceQuantile(const SurfacePiece& surface, double share) {
  std::vector<double> distances;
  for (const Eigen::Vector3f& position : surface.positions) {
    distances.push_back(std::abs(synthetic::DistanceToSphere(kBall, position.cast<double>())) /
                        kGrid.voxel_size);
  }
  std::sort(distances.begin(), distances.end());
  return distances.at(static_cast<size_t>(share * static_cast<double>(distances.size() - 1)));
}

// Every directed edge once, and its opposite too.
bool IsClosed(const SurfacePiece& surface) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : surface.triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  return !edges.empty() && std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    return edge.second == 1 && edges.count({edge.first.second, edge.first.first}) == 1;
  });
}

TEST(Volume, MakesAClosedSphereAcrossTiles) {
  SmallVolume volume = BallVolume(0, 0);
  ThreadPool pool(1);
  volume.Solve({}, pool);
  EXPECT_EQ(volume.Tiles().size(), 8u);
  const SurfacePiece surface = volume.Surface({});
  EXPECT_TRUE(IsClosed(surface));
  EXPECT_EQ(static_cast<int>(surface.keys.size()) - static_cast<int>(surface.triangles.size()) / 2,
            2)
      << "Euler";
  EXPECT_LT(DistanceQuantile(surface, 0.9), 0.15);
  EXPECT_LT(DistanceQuantile(surface, 1.0), 0.5);
  for (size_t i = 0; i < surface.positions.size(); ++i) {
    const Eigen::Vector3d outward =
        (surface.positions[i].cast<double>() - kBall.center).normalized();
    ASSERT_GT(surface.normals[i].cast<double>().dot(outward), 0.8);
    ASSERT_GE(surface.near_maps[i], 1);
  }
  for (const auto& t : surface.triangles) {
    const Eigen::Vector3d a = surface.positions[t[0]].cast<double>(),
                          b = surface.positions[t[1]].cast<double>();
    const Eigen::Vector3d c = surface.positions[t[2]].cast<double>();
    ASSERT_GE((b - a).cross(c - a).dot(a - kBall.center), 0);
  }
}

TEST(Volume, BeatsAveragesUnderNoise) {
  SmallVolume volume = BallVolume(kNoise, kOutliers);
  ThreadPool pool(1);
  volume.Solve({}, pool);
  const SurfacePiece surface = volume.Surface({});
  volume.Average();
  const SurfacePiece average = volume.Surface({});
  EXPECT_LT(DistanceQuantile(surface, 0.9), 0.3);
  EXPECT_LT(DistanceQuantile(surface, 0.9), 0.7 * DistanceQuantile(average, 0.9));
  EXPECT_TRUE(IsClosed(surface));
}

// How far apart two surfaces are on the edges that both cross: the share of vertices over `limit`
// voxels, counting vertices that only one has.
double ShareApart(const SurfacePiece& a, const SurfacePiece& b, int32_t shift_voxels,
                  double limit) {
  std::map<VertexKey, Eigen::Vector3d> places;
  const Eigen::Vector3d shift(shift_voxels, 0, 0);
  for (size_t i = 0; i < a.keys.size(); ++i) {
    VertexKey key = a.keys[i];
    key.x += shift_voxels;
    places[key] = a.positions[i].cast<double>() / kGrid.voxel_size + shift;
  }
  size_t apart = 0;
  for (size_t i = 0; i < b.keys.size(); ++i) {
    const auto found = places.find(b.keys[i]);
    if (found == places.end() ||
        (found->second - b.positions[i].cast<double>() / kGrid.voxel_size).norm() > limit)
      ++apart;
  }
  return static_cast<double>(apart) / static_cast<double>(b.keys.size());
}

TEST(SolveTile, FindsTheSameSurfaceFromAnyStart) {
  SmallVolume volume = BallVolume(kNoise, kOutliers);
  const SolverOptions options = {.iterations_max = 600, .gap_max = 0};
  ThreadPool pool(1);
  const GridPlace tile = {0, 0, 0};
  std::vector<TileBlock> blocks = volume.InReach(tile);
  const auto surface_from = [&](uint64_t seed) {
    SeededRandom random(seed);
    std::vector<std::unique_ptr<SolutionBlock>> starts;
    for (TileBlock& block : blocks) {
      starts.push_back(std::make_unique<SolutionBlock>());
      for (int16_t& value : starts.back()->value) {
        value = static_cast<int16_t>((2 * random.Unit() - 1) * kSolutionOne * (seed == 0 ? 0 : 1));
      }
      block.previous = seed == 1 ? nullptr : starts.back().get();
    }
    volume.solutions.clear();
    TileSolution solution = SolveTile(tile, blocks, options, nullptr, pool).value();
    EXPECT_LT(solution.energies.back().energy - solution.energies.back().lower_bound,
              0.01 * solution.energies.back().energy);
    volume.Keep(std::move(solution));
    return volume.Extract(tile, {.piece_extent_cells_min = 0});
  };
  const SurfacePiece from_means = surface_from(1);
  EXPECT_GT(from_means.keys.size(), 200u);
  EXPECT_LT(ShareApart(from_means, surface_from(0), 0, 0.02), 0.01) << "from zero";
  EXPECT_LT(ShareApart(from_means, surface_from(7), 0, 0.02), 0.01) << "from noise";
}

TEST(SolveTile, LowersTheEnergyToItsEnd) {
  const SmallVolume volume = BallVolume(kNoise, kOutliers);
  ThreadPool pool(1);
  const std::vector<TileBlock> blocks = volume.InReach({0, 0, 0});
  const TileSolution solution = SolveTile({0, 0, 0}, blocks, {}, nullptr, pool).value();
  for (size_t i = 1; i < solution.energies.size(); ++i) {
    EXPECT_LE(solution.energies[i].energy, solution.energies[i - 1].energy)
        << solution.energies[i].iteration;
    EXPECT_LE(solution.energies[i].lower_bound, solution.energies[i].energy);
  }
  const SolverOptions longer = {.iterations_max = 10 * solution.iterations, .gap_max = 0};
  const TileSolution end = SolveTile({0, 0, 0}, blocks, longer, nullptr, pool).value();
  EXPECT_LT(solution.energies.back().energy, 1.001 * end.energies.back().energy);
}

TEST(SolveTile, StartsWarm) {
  SmallVolume volume = BallVolume(kNoise, kOutliers);
  ThreadPool pool(1);
  const GridPlace tile = {0, 0, 0};
  const SolverOptions options = {.check_every = 2};
  volume.Solve(options, pool);
  const std::vector<RangeImage> images = BallImages(kNoise, kOutliers);
  for (auto& [at, block] : volume.histograms)
    ASSERT_TRUE(Integrate(images[3], kGrid, at, -1, block.get()).ok());
  std::vector<TileBlock> blocks = volume.InReach(tile);
  const TileSolution cold = SolveTile(tile, blocks, options, nullptr, pool).value();
  for (TileBlock& block : blocks) block.previous = volume.solutions.at(block.index).get();
  const TileSolution warm = SolveTile(tile, blocks, options, nullptr, pool).value();
  EXPECT_LE(5 * warm.iterations, 4 * cold.iterations)
      << warm.iterations << " beside " << cold.iterations;
  EXPECT_LT(warm.energies.back().energy, 1.001 * cold.energies.back().energy);
}

TEST(SolveTile, ThreadsDoNotMatter) {
  const SmallVolume volume = BallVolume(kNoise, kOutliers);
  const std::vector<TileBlock> blocks = volume.InReach({0, -1, 0});
  ThreadPool none(0), some(3);
  const TileSolution a = SolveTile({0, -1, 0}, blocks, {}, nullptr, none).value();
  const TileSolution b = SolveTile({0, -1, 0}, blocks, {}, nullptr, some).value();
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  ASSERT_FALSE(a.blocks.empty());
  for (size_t i = 0; i < a.blocks.size(); ++i) {
    EXPECT_EQ(a.blocks[i].index, b.blocks[i].index);
    EXPECT_EQ(*a.blocks[i].solution, *b.blocks[i].solution);
  }
}

TEST(SolveTile, TheDeviceDoesNotMatter) {
  if (ListDevices().empty()) GTEST_SKIP() << "no OpenCL device";
  const std::unique_ptr<Device> device = Device::Open({}).value();
  const SmallVolume volume = BallVolume(kNoise, kOutliers);
  const std::vector<TileBlock> blocks = volume.InReach({-1, 0, 0});
  ThreadPool pool(1);
  const TileSolution a = SolveTile({-1, 0, 0}, blocks, {}, nullptr, pool).value();
  const TileSolution b = SolveTile({-1, 0, 0}, blocks, {}, device.get(), pool).value();
  EXPECT_EQ(a.iterations, b.iterations);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  ASSERT_FALSE(a.blocks.empty());
  for (size_t i = 0; i < a.blocks.size(); ++i)
    EXPECT_EQ(*a.blocks[i].solution, *b.blocks[i].solution);
}

TEST(SolveTile, HoldsTheBordersOfTheRoundBefore) {
  SmallVolume volume = BallVolume(kNoise, kOutliers);
  ThreadPool pool(1);
  const GridPlace tile = {0, 0, 0};
  volume.Solve({}, pool);
  std::vector<TileBlock> blocks = volume.InReach(tile);
  for (TileBlock& block : blocks) {
    block.previous = volume.solutions.at(block.index).get();
    if (!IsInTile(block.index, tile)) block.border = block.previous;
  }
  const SurfacePiece first = volume.Extract(tile, {.piece_extent_cells_min = 0});
  volume.Keep(SolveTile(tile, blocks, {}, nullptr, pool).value());
  EXPECT_LT(ShareApart(first, volume.Extract(tile, {.piece_extent_cells_min = 0}), 0, 0.1), 0.02)
      << "nothing new";
  // Where data weigh little, neighbours that say "free" or "matter" throughout show within the
  // tile.
  SolutionBlock free_space, matter;
  free_space.value.fill(kSolutionOne);
  matter.value.fill(-kSolutionOne);
  const auto solve_beside = [&](const SolutionBlock& border) {
    for (TileBlock& block : blocks) {
      block.previous = nullptr;  // what it named is gone
      block.border = IsInTile(block.index, tile) ? nullptr : &border;
    }
    return SolveTile(tile, blocks, {.lambda = 0.02}, nullptr, pool).value();
  };
  const TileSolution beside_free = solve_beside(free_space), beside_matter = solve_beside(matter);
  int higher = 0, lower = 0;
  for (size_t b = 0; b < beside_free.blocks.size(); ++b) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const int difference =
          beside_free.blocks[b].solution->value[i] - beside_matter.blocks[b].solution->value[i];
      higher += difference > kSolutionOne / 20 ? 1 : 0;
      lower += difference < -kSolutionOne / 20 ? 1 : 0;
    }
  }
  EXPECT_GT(higher, 100);
  EXPECT_EQ(lower, 0);
  for (TileBlock& block : blocks) block.border = &free_space;
  EXPECT_EQ(SolveTile(tile, blocks, {}, nullptr, pool).status().code(),
            StatusCode::kInvalidArgument);
}

// A noisy wall of two tiles' length; `shift_voxels` moves all, and so the borders, along x.
SurfacePiece WallSurface(int32_t shift_voxels) {
  SmallVolume volume;
  volume.grid = kGrid;
  const synthetic::Shapes wall = {{0, 0, 0}, 0, 1.0};
  const double shift = shift_voxels * kGrid.voxel_size;
  std::vector<RangeImage> images;
  for (int i = 0; i < 9; ++i) {
    ViewGeometry view =
        synthetic::LookAt({0.4 * i - 1.6, -1, 0.8}, {0.3 * i - 1.2, 1, 0.8}, 128, 96);
    const DepthMap map = synthetic::Render(wall, view, kNoise, kOutliers, static_cast<uint64_t>(i));
    view.cam_from_world.translation -= view.cam_from_world.rotation * Eigen::Vector3d(shift, 0, 0);
    images.push_back(RangeImage::Make(map, view).value());
  }
  volume.Integrate(images, 8);
  ThreadPool pool(1);
  volume.Solve({}, pool);
  return volume.Surface({});
}

TEST(SolveTile, BordersLeaveNoSeam) {
  const SurfacePiece at_home = WallSurface(0), moved = WallSurface(kTileSide / 2);
  ASSERT_GT(at_home.keys.size(), 2500u);
  EXPECT_LT(ShareApart(at_home, moved, kTileSide / 2, 0.02), 0.01);
}

TEST(SolveTile, RefusesWhatDoesNotFit) {
  const SmallVolume volume = BallVolume(0, 0);
  ThreadPool pool(0);
  std::vector<TileBlock> blocks = volume.InReach({0, 0, 0});
  const auto code = [&](const GridPlace& tile, const SolverOptions& options) {
    return SolveTile(tile, blocks, options, nullptr, pool).status().code();
  };
  EXPECT_EQ(code({5, 0, 0}, {}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({0, 0, 0}, {.lambda = 0}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({0, 0, 0}, {.check_every = 0}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({0, 0, 0}, {.gap_max = 1}), StatusCode::kInvalidArgument);
  std::swap(blocks[0], blocks[1]);
  EXPECT_EQ(code({0, 0, 0}, {}), StatusCode::kInvalidArgument);
  std::swap(blocks[0], blocks[1]);
  blocks[2].histogram = nullptr;
  EXPECT_EQ(code({0, 0, 0}, {}), StatusCode::kInvalidArgument);
  blocks.clear();
  EXPECT_TRUE(SolveTile({0, 0, 0}, blocks, {}, nullptr, pool).value().blocks.empty());
}

}  // namespace
}  // namespace veduta
