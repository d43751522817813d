// SPDX-License-Identifier: Apache-2.0
#pragma once
// A floor with sheets of markers on it, as somebody lays them out who wants to calibrate a camera.
//
// World: metres, z up, the floor at z = 0; the sheets lie around the origin. A sheet's frame is
// that of the paper in SheetLayout: x to the right and y down as printed. Once the sheet lies on
// the floor, its y axis runs against the world's.

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/camera/markers/sheet_layout.h"
#include "storage/base/status.h"

namespace veduta::floor {

enum class Flooring : uint8_t {
  kPlain,
  kWood,
  kTile,
  kTerrazzo,  // full of dark and bright pebbles
};

// Something that lies on the sheets: a rectangle or an ellipse, flat, of one colour.
struct Cover {
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_m = {0.1, 0.1};
  double angle_rad = 0;
  double reflectance = 0.1;  // [0, 1]
  bool is_ellipse = false;
};

struct FloorOptions {
  Paper paper = Paper::kA4;
  uint32_t marker_count = 96;  // [1, kMarkerIdCount]
  bool is_scattered = true;    // any place and any angle, apart; otherwise a grid
  double bend_mm = 2;          // [0, 50]; a sheet's farthest corner rises by a random part of it
  Flooring flooring = Flooring::kWood;
  uint32_t cover_count = 0;   // [0, 1000]; random things lying about, some on the sheets
  std::vector<Cover> covers;  // more things that lie about, at given places
  uint64_t seed = 1;

  Status Check() const;  // the first violated bound, named with its value
};

std::vector<std::string_view> FlooringNames();  // in the order of the values

struct FloorMarker {
  MarkerId id = 0;
  double radius_m = 0;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
};

// Immutable, so any number of threads may look at it.
class Floor final {
 public:
  // kInvalidArgument on bad options.
  static Result<Floor> Build(const FloorOptions& options);

  // The reflectance of what a ray from `origin` along `direction` (of any length) meets, [0, 1].
  // Above the horizon there is a wall.
  float Reflectance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  const std::vector<FloorMarker>& markers() const { return markers_; }
  bool IsCovered(const Eigen::Vector2d& place_m) const;
  double extent_m() const {
    return extent_m_;
  }  // all sheets lie within this distance of the origin

 private:
  struct PlacedSheet {
    uint32_t index;  // in layout_.sheets
    Eigen::Vector2d center_m;
    double cosine, sine;        // of its angle
    double bend_m;              // height of the farthest corner
    Eigen::Vector2d bend_axis;  // unit, sheet frame
  };

  Floor() = default;
  void PlaceInGrid();
  void PlaceAnywhere();
  void PutDown(uint32_t index, const Eigen::Vector2d& center_m, double angle_rad);
  void ListMarkers();
  void ThrowCovers(uint32_t count);
  void FillGrid();
  int SheetAt(const Eigen::Vector2d& place_m) const;
  // Millimetres on the paper, and back.
  Eigen::Vector2d OnPaper(const PlacedSheet& sheet, const Eigen::Vector2d& place_m) const;
  Eigen::Vector2d OnFloor(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const;
  double Height(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const;
  float PaperReflectance(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const;

  FloorOptions options_;
  SheetLayout layout_;
  std::vector<PlacedSheet> sheets_;
  std::vector<Cover> covers_;
  std::vector<FloorMarker> markers_;
  double extent_m_ = 0;
  int grid_side_ = 0;
  std::vector<std::vector<uint16_t>> grid_;  // sheets that may be in a cell
};

// The reflectance of the bare floor. It depends on the place alone.
float FlooringReflectance(Flooring flooring, const Eigen::Vector2d& place_m, uint64_t seed);

}  // namespace veduta::floor
