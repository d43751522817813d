// SPDX-License-Identifier: Apache-2.0
#pragma once
// All steps of the volume in memory, tile by tile, for tests.

#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "fusion/volume/extraction.h"
#include "fusion/volume/histogram.h"
#include "fusion/volume/solver.h"

namespace veduta {

struct SmallVolume {
  VolumeGrid grid;
  std::map<GridPlace, std::unique_ptr<HistogramBlock>> histograms;
  std::map<GridPlace, std::unique_ptr<SolutionBlock>> solutions;

  void Integrate(const std::vector<RangeImage>& images, uint32_t pixels_min) {
    std::map<GridPlace, uint32_t> named;
    for (const RangeImage& image : images) {
      for (const NamedBlock& block : image.BlocksNearSurface(grid))
        named[block.block] += block.pixel_count;
    }
    for (const auto& [block, pixels] : named) {
      if (pixels < pixels_min) continue;
      auto histogram = std::make_unique<HistogramBlock>();
      for (const RangeImage& image : images)
        veduta::Integrate(image, grid, block, 1, histogram.get()).value();
      histograms.emplace(block, std::move(histogram));
    }
  }
  std::set<GridPlace> Tiles() const {
    std::set<GridPlace> tiles;
    for (const auto& block : histograms) tiles.insert(TileOf(block.first));
    return tiles;
  }
  std::vector<TileBlock> InReach(const GridPlace& tile) const {
    std::vector<TileBlock> blocks;
    for (const GridPlace& at : BlocksInReach(tile)) {
      const auto found = histograms.find(at);
      if (found != histograms.end()) blocks.push_back({at, found->second.get(), nullptr, nullptr});
    }
    return blocks;
  }
  void Keep(TileSolution solution) {
    for (SolvedBlock& block : solution.blocks) solutions[block.index] = std::move(block.solution);
  }
  void Solve(const SolverOptions& options, ThreadPool& pool) {
    for (const GridPlace& tile : Tiles())
      Keep(SolveTile(tile, InReach(tile), options, nullptr, pool).value());
  }
  void Average() {
    for (const GridPlace& tile : Tiles()) Keep(AverageTile(tile, InReach(tile)).value());
  }
  SurfacePiece Extract(const GridPlace& tile, const ExtractionOptions& options) const {
    std::vector<ExtractionBlock> blocks;
    for (const GridPlace& at : BlocksInReach(tile)) {
      const auto found = solutions.find(at);
      if (found != solutions.end()) blocks.push_back({at, found->second.get()});
    }
    return ExtractSurface(tile, blocks, grid, options).value();
  }
  SurfacePiece Surface(const ExtractionOptions& options) const {
    std::vector<SurfacePiece> pieces;
    for (const GridPlace& tile : Tiles()) pieces.push_back(Extract(tile, options));
    std::vector<const SurfacePiece*> all;
    for (const SurfacePiece& piece : pieces) all.push_back(&piece);
    return WeldPieces(all);
  }
};

}  // namespace veduta
