// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/extraction.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "fusion/volume/marching_cubes.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr int32_t kSide = kTileSide + 2 * kBlockSide;  // of the tile with its halo, voxels
constexpr int32_t kCells = kSide - 1;
constexpr int kUnobservedCornersMax =
    2;  // of a cell, and only with values filled in from their neighbours
constexpr float kInterpolationMin =
    1.f / 64;  // vertices keep off the voxels' centres: no triangle without area

// The tile with its halo as one array; at(x, y, z) with 0 at the halo's low end.
struct Window {
  std::vector<int16_t> value = std::vector<int16_t>(kSide * kSide * kSide, 0);
  std::vector<uint8_t> support = std::vector<uint8_t>(kSide * kSide * kSide, 0);

  static size_t At(int32_t x, int32_t y, int32_t z) {
    return static_cast<size_t>((z * kSide + y) * kSide + x);
  }
};
constexpr size_t kStep[3] = {1, kSide, static_cast<size_t>(kSide) * kSide};

Window MakeWindow(const GridPlace& tile, std::span<const ExtractionBlock> blocks) {
  Window window;
  const GridPlace low = FirstBlock(tile);
  for (const ExtractionBlock& block : blocks) {
    const int32_t x = (block.index.x - low.x + 1) * kBlockSide,
                  y = (block.index.y - low.y + 1) * kBlockSide;
    const int32_t z = (block.index.z - low.z + 1) * kBlockSide;
    for (int32_t k = 0; k < kBlockSide; ++k) {
      for (int32_t j = 0; j < kBlockSide; ++j) {
        const size_t to = Window::At(x, y + j, z + k), from = VoxelOffset(0, j, k);
        std::copy_n(block.solution->value.begin() + from, kBlockSide, window.value.begin() + to);
        std::copy_n(block.solution->support.begin() + from, kBlockSide,
                    window.support.begin() + to);
      }
    }
  }
  return window;
}

// The corners within matter; 0 also where the cell is not to be drawn.
uint8_t InsideOf(const Window& window, size_t cell, uint32_t near_maps_min) {
  uint8_t inside = 0;
  int unobserved = 0;
  int near[2] = {0, 0};  // most maps near a corner: outside, inside
  for (int corner = 0; corner < kCellCorners; ++corner) {
    const size_t at = cell + (corner & 1) * kStep[0] + (corner >> 1 & 1) * kStep[1] +
                      (corner >> 2 & 1) * kStep[2];
    if (window.support[at] == 0 && (++unobserved > kUnobservedCornersMax || window.value[at] == 0))
      return 0;
    const int is_inside = window.value[at] < 0 ? 1 : 0;
    inside |= static_cast<uint8_t>(is_inside << corner);
    near[is_inside] = std::max(near[is_inside], std::max<int>(window.support[at], 1) - 1);
  }
  if (inside == 255 || std::min(near[0], near[1]) < static_cast<int>(near_maps_min)) return 0;
  return inside;
}

struct Cell {
  uint16_t x, y, z;
  uint8_t inside;
};

std::vector<Cell> FindCells(const Window& window, uint32_t near_maps_min) {
  std::vector<Cell> cells;
  for (uint16_t z = 0; z < kCells; ++z) {
    for (uint16_t y = 0; y < kCells; ++y) {
      for (uint16_t x = 0; x < kCells; ++x) {
        const uint8_t inside = InsideOf(window, Window::At(x, y, z), near_maps_min);
        if (inside != 0) cells.push_back({x, y, z, inside});
      }
    }
  }
  return cells;
}

// A window's vertex: three times the voxel plus the axis.
size_t VertexOf(const Cell& cell, int edge) {
  const CellEdge& e = CellEdges()[edge];
  return 3 * (Window::At(cell.x, cell.y, cell.z) + (e.corner & 1) * kStep[0] +
              (e.corner >> 1 & 1) * kStep[1] + (e.corner >> 2 & 1) * kStep[2]) +
         e.axis;
}

// Connected pieces of surface: vertices joined by triangles, with the extent of the cells that drew
// them.
class Pieces {
 public:
  void Add(const Cell& cell) {
    for (const auto& triangle : TrianglesOfCell(cell.inside)) {
      const uint32_t first = NumberOf(VertexOf(cell, triangle[0]));
      Grow(&boxes_[Root(first)], cell);
      for (const int corner : {1, 2}) Join(first, NumberOf(VertexOf(cell, triangle[corner])));
    }
  }

  // Whether the vertex's piece fits into fewer than `extent` cells along all axes.
  bool IsSmall(size_t vertex, uint32_t extent) {
    const Box& box = boxes_[Root(number_[vertex])];
    for (int axis = 0; axis < 3; ++axis) {
      if (static_cast<uint32_t>(box.high[axis] - box.low[axis] + 1) >= extent) return false;
    }
    return true;
  }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  struct Box {
    std::array<int32_t, 3> low = {kSide, kSide, kSide}, high = {-1, -1, -1};
  };

  static void Grow(Box* box, const Cell& cell) {
    const std::array<int32_t, 3> at = {cell.x, cell.y, cell.z};
    for (int axis = 0; axis < 3; ++axis) {
      box->low[axis] = std::min(box->low[axis], at[axis]);
      box->high[axis] = std::max(box->high[axis], at[axis]);
    }
  }

  uint32_t NumberOf(size_t vertex) {
    if (number_[vertex] == kNone) {
      number_[vertex] = static_cast<uint32_t>(parent_.size());
      parent_.push_back(number_[vertex]);
      boxes_.emplace_back();
    }
    return number_[vertex];
  }

  uint32_t Root(uint32_t number) {
    while (parent_[number] != number) number = parent_[number] = parent_[parent_[number]];
    return number;
  }

  void Join(uint32_t a, uint32_t b) {
    a = Root(a), b = Root(b);
    if (a == b) return;
    if (b < a) std::swap(a, b);
    parent_[b] = a;
    for (int axis = 0; axis < 3; ++axis) {
      boxes_[a].low[axis] = std::min(boxes_[a].low[axis], boxes_[b].low[axis]);
      boxes_[a].high[axis] = std::max(boxes_[a].high[axis], boxes_[b].high[axis]);
    }
  }

  std::vector<uint32_t> number_ =
      std::vector<uint32_t>(3 * static_cast<size_t>(kSide) * kSide * kSide, kNone);
  std::vector<uint32_t> parent_;
  std::vector<Box> boxes_;
};

bool IsOwn(const Cell& cell) {
  const auto within = [](int32_t at) { return at >= kBlockSide && at < kBlockSide + kTileSide; };
  return within(cell.x) && within(cell.y) && within(cell.z);
}

// Central differences; towards voxels that nobody saw, one-sided ones.
Eigen::Vector3f GradientAt(const Window& window, size_t at) {
  Eigen::Vector3f gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const size_t before = window.support[at - kStep[axis]] > 0 ? at - kStep[axis] : at;
    const size_t after = window.support[at + kStep[axis]] > 0 ? at + kStep[axis] : at;
    const int voxels = (before != at) + (after != at);
    const float difference =
        static_cast<float>(window.value[after]) - static_cast<float>(window.value[before]);
    gradient[axis] = voxels == 0 ? 0.f : difference / static_cast<float>(voxels);
  }
  return gradient;
}

void AddVertex(const Window& window, const VertexKey& key, size_t from, const VolumeGrid& grid,
               SurfacePiece* piece) {
  const size_t to = from + kStep[key.axis];
  const auto a = static_cast<float>(window.value[from]), b = static_cast<float>(window.value[to]);
  const float share = std::clamp(a / (a - b), kInterpolationMin, 1 - kInterpolationMin);
  Eigen::Vector3d place = Eigen::Vector3d(key.x, key.y, key.z) + Eigen::Vector3d::Constant(0.5);
  place[key.axis] += share;
  Eigen::Vector3f normal = (1 - share) * GradientAt(window, from) + share * GradientAt(window, to);
  if (!(normal.squaredNorm() > 0)) normal = Eigen::Vector3f::Unit(key.axis) * (b > a ? 1.f : -1.f);
  piece->keys.push_back(key);
  piece->positions.push_back((place * grid.voxel_size).cast<float>());
  piece->normals.push_back(normal.normalized());
  const uint8_t support = std::min(window.support[from], window.support[to]);
  piece->near_maps.push_back(support > 0 ? support - 1 : 0);
}

SurfacePiece MakePiece(const Window& window, const GridPlace& tile,
                       const std::vector<std::array<size_t, 3>>& triangles,
                       const VolumeGrid& grid) {
  const GridPlace low = FirstBlock(tile);
  const auto key_of = [&](size_t vertex) {
    const auto axis = static_cast<int32_t>(vertex % 3), at = static_cast<int32_t>(vertex / 3);
    return VertexKey{(low.x - 1) * kBlockSide + at % kSide,
                     (low.y - 1) * kBlockSide + at / kSide % kSide,
                     (low.z - 1) * kBlockSide + at / (kSide * kSide), axis};
  };
  std::vector<size_t> vertices;
  for (const auto& triangle : triangles)
    vertices.insert(vertices.end(), triangle.begin(), triangle.end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  std::sort(vertices.begin(), vertices.end(),
            [&](size_t a, size_t b) { return key_of(a) < key_of(b); });
  SurfacePiece piece;
  std::vector<uint32_t> number(3 * window.value.size());
  for (const size_t vertex : vertices) {
    number[vertex] = static_cast<uint32_t>(piece.keys.size());
    AddVertex(window, key_of(vertex), vertex / 3, grid, &piece);
  }
  for (const auto& t : triangles)
    piece.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  return piece;
}

Status CheckBlocks(const GridPlace& tile, std::span<const ExtractionBlock> blocks) {
  for (size_t i = 0; i < blocks.size(); ++i) {
    const GridPlace& at = blocks[i].index;
    const char* wrong = !IsInReach(at, tile)                   ? "is out of the tile's reach"
                        : i > 0 && !(blocks[i - 1].index < at) ? "is not in ascending order"
                        : blocks[i].solution == nullptr        ? "has no solution"
                                                               : nullptr;
    if (wrong) {
      return Status::InvalidArgument("block (" + std::to_string(at.x) + ", " +
                                     std::to_string(at.y) + ", " + std::to_string(at.z) + ") " +
                                     wrong);
    }
  }
  return Status::Ok();
}

}  // namespace

Status ExtractionOptions::Check() const {
  // A larger piece reaches past the halo, which then does not show it whole.
  return OptionBounds()
      .Between("near_maps_min", near_maps_min, 0, 254)
      .Between("piece_extent_cells_min", piece_extent_cells_min, 0, kBlockSide - 1)
      .status();
}

Result<SurfacePiece> ExtractSurface(const GridPlace& tile, std::span<const ExtractionBlock> blocks,
                                    const VolumeGrid& grid, const ExtractionOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(grid.Check());
  VEDUTA_RETURN_IF_ERROR(CheckBlocks(tile, blocks));
  const Window window = MakeWindow(tile, blocks);
  const std::vector<Cell> cells = FindCells(window, options.near_maps_min);
  Pieces pieces;
  for (const Cell& cell : cells) pieces.Add(cell);
  std::vector<std::array<size_t, 3>> triangles;
  for (const Cell& cell : cells) {
    if (!IsOwn(cell)) continue;
    for (const auto& t : TrianglesOfCell(cell.inside)) {
      if (pieces.IsSmall(VertexOf(cell, t[0]), options.piece_extent_cells_min)) continue;
      triangles.push_back({VertexOf(cell, t[0]), VertexOf(cell, t[1]), VertexOf(cell, t[2])});
    }
  }
  return MakePiece(window, tile, triangles, grid);
}

}  // namespace veduta
