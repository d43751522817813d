// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far a mesh is from the true one, and how much of the true one it covers.

#include <Eigen/Core>
#include <map>
#include <vector>

#include "tools/bench/fusion/rendered_maps.h"
#include "tools/render/street/quad_mesh.h"

namespace veduta::fusion_benchmark {

// Distances to the street's quads, by a grid of cells.
class TrueSurface final {
 public:
  TrueSurface(const street::QuadMesh& mesh, double reach);
  // To the nearest quad; `reach` where none is nearer.
  double DistanceTo(const Eigen::Vector3d& point) const;
  // A point about every `spacing` on quads, with its normal.
  struct Sample {
    Eigen::Vector3d point, normal;
  };
  std::vector<Sample> SamplesWithin(double spacing, const Eigen::Vector3d& low,
                                    const Eigen::Vector3d& high) const;

 private:
  struct Quad {
    Eigen::Vector3d corners[4];
  };
  using Cell = std::array<int, 3>;
  double reach_;
  std::vector<Quad> quads_;
  std::map<Cell, std::vector<uint32_t>> cells_;
};

// Whether a map saw the point: it lies within the picture, in front, turned towards the camera,
// nearer than `distance_max`, and the true depth there agrees within 0.5 %.
bool Sees(const RenderedMap& map, const TrueSurface::Sample& sample, double distance_max);

// The nearest of many points.
class PointGrid final {
 public:
  PointGrid(const std::vector<Eigen::Vector3f>& points, double cell);
  bool HasNear(const Eigen::Vector3d& point, double distance) const;  // distance <= cell

 private:
  double cell_;
  const std::vector<Eigen::Vector3f>& points_;
  std::map<std::array<int, 3>, std::vector<uint32_t>> cells_;
};

}  // namespace veduta::fusion_benchmark
