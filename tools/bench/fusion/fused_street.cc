// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/fusion/fused_street.h"

#include <chrono>
#include <cmath>

#include "fusion/volume/tile_problem.h"
#include "kernels/total_variation.h"
#include "storage/base/content_hash.h"

namespace veduta::fusion_benchmark {
namespace {

std::string PieceName(const std::string& kind, const GridPlace& tile) {
  return NameOf((kind + "_piece").c_str(), {tile.x, tile.y, tile.z});
}

void WriteSolutions(const std::string& kind, const TileSolution& solution, BlockFiles* files) {
  for (const SolvedBlock& block : solution.blocks) {
    files->Write(NameOf(kind.c_str(), block.index), Serialize(*block.solution));
  }
}

}  // namespace

void FusedStreet::Name(const RangeImage& image) {
  for (const NamedBlock& block : image.BlocksNearSurface(grid_))
    named_[block.block] += block.pixel_count;
}

std::vector<GridPlace> FusedStreet::blocks() const {
  std::vector<GridPlace> blocks;
  for (const auto& [block, pixels] : named_) {
    if (pixels >= pixels_min_) blocks.push_back(block);
  }
  return blocks;
}

std::set<GridPlace> FusedStreet::tiles() const {
  std::set<GridPlace> tiles;
  for (const GridPlace& block : blocks()) tiles.insert(TileOf(block));
  return tiles;
}

std::unique_ptr<HistogramBlock> FusedStreet::ReadHistogram(const GridPlace& block) const {
  const std::vector<uint8_t> bytes = files_.Read(NameOf("histogram", block));
  return bytes.empty() ? std::make_unique<HistogramBlock>() : ParseHistogramBlock(bytes).value();
}

std::unique_ptr<SolutionBlock> FusedStreet::ReadSolution(const std::string& kind,
                                                         const GridPlace& block) const {
  const std::vector<uint8_t> bytes = files_.Read(NameOf(kind.c_str(), block));
  return bytes.empty() ? nullptr : ParseSolutionBlock(bytes).value();
}

std::vector<GridPlace> FusedStreet::Add(const RangeImage& image, int sign) {
  std::vector<GridPlace> seen;
  for (const GridPlace& block : blocks()) {
    if (image.MaySee(block, grid_)) seen.push_back(block);
  }
  std::vector<uint64_t> sizes(seen.size());
  pool_.ParallelFor(seen.size(), [&](size_t i) {
    const std::unique_ptr<HistogramBlock> histogram = ReadHistogram(seen[i]);
    if (!Integrate(image, grid_, seen[i], sign, histogram.get()).value().changed) return;
    const std::vector<uint8_t> bytes = Serialize(*histogram);
    sizes[i] = bytes.size();
    files_.Write(NameOf("histogram", seen[i]), bytes);
  });
  std::vector<GridPlace> changed;
  for (size_t i = 0; i < seen.size(); ++i) {
    histogram_bytes_ += sizes[i];
    if (sizes[i] > 0) changed.push_back(seen[i]);
  }
  return changed;
}

FusedStreet::Loaded FusedStreet::Load(const GridPlace& tile, const std::string& previous,
                                      const std::string& border) const {
  Loaded loaded;
  for (const GridPlace& block : BlocksInReach(tile)) {
    const auto found = named_.find(block);
    if (found == named_.end() || found->second < pixels_min_) continue;
    loaded.histograms.push_back(ReadHistogram(block));
    loaded.previous.push_back(previous.empty() ? nullptr : ReadSolution(previous, block));
    const bool has_border = !border.empty() && !IsInTile(block, tile);
    loaded.border.push_back(has_border ? ReadSolution(border, block) : nullptr);
    loaded.blocks.push_back({block, loaded.histograms.back().get(), loaded.previous.back().get(),
                             loaded.border.back().get()});
  }
  return loaded;
}

SolveReport FusedStreet::SolveTiles(const std::set<GridPlace>& tiles, const char* kind,
                                    const std::string& previous, const SolverOptions& options,
                                    Device* device, const std::string& border) {
  SolveReport report;
  for (const GridPlace& tile : tiles) {
    const Loaded loaded = Load(tile, previous, border);
    const auto start = std::chrono::steady_clock::now();
    const TileSolution solution = SolveTile(tile, loaded.blocks, options, device, pool_).value();
    report.seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++report.tiles;
    report.blocks_solved += loaded.blocks.size();
    report.iterations += solution.iterations;
    report.voxel_iterations += solution.iterations * loaded.blocks.size() * kBlockVoxels;
    report.energy_start += solution.energies.front().energy;
    report.energy_end += solution.energies.back().energy;
    report.lower_bound += solution.energies.back().lower_bound;
    WriteSolutions(kind, solution, &files_);
  }
  return report;
}

void FusedStreet::Average(const char* kind) {
  for (const GridPlace& tile : tiles()) {
    WriteSolutions(kind, AverageTile(tile, Load(tile, "").blocks).value(), &files_);
  }
}

SolveReport FusedStreet::SolveWhole(const char* kind, uint32_t iterations, double lambda) {
  Loaded all;
  for (const GridPlace& block : blocks()) {
    all.histograms.push_back(ReadHistogram(block));
    all.blocks.push_back({block, all.histograms.back().get(), nullptr, nullptr});
  }
  std::vector<float> u;
  for (const TileBlock& block : all.blocks) {
    for (size_t i = 0; i < kBlockVoxels; ++i) u.push_back(MeanOf(*block.histogram, i));
  }
  const auto start = std::chrono::steady_clock::now();
  const auto minimisation =
      TotalVariation::Start(
          MakeTileProblem({}, all.blocks, static_cast<float>(lambda / kVoteWeightMax), pool_), u,
          {}, nullptr, pool_)
          .value();
  VEDUTA_CHECK(minimisation->Iterate(iterations).ok(), "whole");
  const TvEnergy energy = minimisation->Energy().value();
  u = minimisation->Read().value();
  SolveReport report;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report.tiles = 1;
  report.blocks_solved = all.blocks.size();
  report.iterations = iterations;
  report.voxel_iterations = uint64_t{iterations} * all.blocks.size() * kBlockVoxels;
  report.energy_end = energy.primal;
  report.lower_bound = energy.dual;
  for (const GridPlace& tile : tiles()) {
    TileSolution solution;
    solution.blocks = KeepOwnBlocks(tile, all.blocks, u, {});
    WriteSolutions(kind, solution, &files_);
  }
  return report;
}

void FusedStreet::Scatter(const char* kind, uint64_t seed) {
  SeededRandom random(seed);
  for (const GridPlace& block : blocks()) {
    SolutionBlock solution;
    for (int16_t& value : solution.value) {
      value = seed == 0 ? int16_t{0}
                        : static_cast<int16_t>(std::lround((2 * random.Unit() - 1) * kSolutionOne));
    }
    files_.Write(NameOf(kind, block), Serialize(solution));
  }
}

std::vector<EnergyReport> FusedStreet::EnergiesOf(const GridPlace& tile,
                                                  const SolverOptions& options, Device* device) {
  return SolveTile(tile, Load(tile, "").blocks, options, device, pool_).value().energies;
}

size_t FusedStreet::Extract(const char* kind, const ExtractionOptions& options) {
  size_t triangles = 0;
  for (const GridPlace& tile : tiles()) {
    std::vector<std::unique_ptr<SolutionBlock>> solutions;
    std::vector<ExtractionBlock> blocks;
    for (const GridPlace& block : BlocksInReach(tile)) {
      std::unique_ptr<SolutionBlock> solution = ReadSolution(kind, block);
      if (!solution) continue;
      solutions.push_back(std::move(solution));
      blocks.push_back({block, solutions.back().get()});
    }
    const SurfacePiece piece = ExtractSurface(tile, blocks, grid_, options).value();
    triangles += piece.triangles.size();
    files_.Write(PieceName(kind, tile), Serialize(piece));
  }
  return triangles;
}

SurfacePiece FusedStreet::Weld(const char* kind) const {
  std::vector<SurfacePiece> pieces;
  std::vector<const SurfacePiece*> all;
  for (const GridPlace& tile : tiles()) {
    pieces.push_back(ParseSurfacePiece(files_.Read(PieceName(kind, tile))).value());
  }
  for (const SurfacePiece& piece : pieces) all.push_back(&piece);
  return WeldPieces(all);
}

}  // namespace veduta::fusion_benchmark
