// SPDX-License-Identifier: Apache-2.0
#include "tools/render/floor/floor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "engine/camera/markers/marker_pattern.h"
#include "storage/base/content_hash.h"

namespace veduta::floor {
namespace {

constexpr float kInk = 0.04f, kPaper = 0.85f, kWall = 0.3f;
constexpr double kCellM = 0.05;
constexpr double kGapM = 0.02;  // between sheets of a grid, and at least between scattered ones

bool IsUnder(const Cover& cover, const Eigen::Vector2d& place_m) {
  const Eigen::Vector2d d = place_m - cover.center_m;
  if (d.squaredNorm() > cover.half_m.squaredNorm()) return false;
  const double c = std::cos(cover.angle_rad), s = std::sin(cover.angle_rad);
  const double x = (c * d.x() + s * d.y()) / cover.half_m.x(),
               y = (c * d.y() - s * d.x()) / cover.half_m.y();
  return cover.is_ellipse ? x * x + y * y < 1 : std::abs(x) < 1 && std::abs(y) < 1;
}

}  // namespace

Status FloorOptions::Check() const {
  if (marker_count < 1 || marker_count > kMarkerIdCount) {
    return Status::InvalidArgument("marker_count = " + std::to_string(marker_count) +
                                   " is not in 1.." + std::to_string(kMarkerIdCount));
  }
  if (!(bend_mm >= 0 && bend_mm <= 50)) {
    return Status::InvalidArgument("bend_mm = " + std::to_string(bend_mm) + " is not in [0, 50]");
  }
  if (cover_count > 1000) {
    return Status::InvalidArgument("cover_count = " + std::to_string(cover_count) +
                                   " is over 1000");
  }
  return Status::Ok();
}

Result<Floor> Floor::Build(const FloorOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  Floor floor;
  floor.options_ = options;
  VEDUTA_ASSIGN_OR_RETURN(floor.layout_, LayOutSheets(options.paper, options.marker_count));
  if (options.is_scattered) {
    floor.PlaceAnywhere();
  } else {
    floor.PlaceInGrid();
  }
  floor.ListMarkers();
  floor.FillGrid();
  floor.covers_ = options.covers;
  floor.ThrowCovers(options.cover_count);
  return floor;
}

void Floor::PutDown(uint32_t index, const Eigen::Vector2d& center_m, double angle_rad) {
  SeededRandom random(MixSeed(options_.seed, 1000 + index));
  const double bend_m = options_.bend_mm / 1000 * random.Unit();
  const double axis_rad = 2 * std::numbers::pi * random.Unit();
  sheets_.push_back({index,
                     center_m,
                     std::cos(angle_rad),
                     std::sin(angle_rad),
                     bend_m,
                     {std::cos(axis_rad), std::sin(axis_rad)}});
  const double half_diagonal_m = std::hypot(layout_.width_mm, layout_.height_mm) / 2000;
  extent_m_ = std::max(extent_m_, center_m.norm() + half_diagonal_m);
}

void Floor::PlaceInGrid() {
  const auto count = static_cast<int>(layout_.sheets.size());
  const int columns =
      static_cast<int>(std::ceil(std::sqrt(count * layout_.height_mm / layout_.width_mm)));
  const int rows = (count + columns - 1) / columns;
  const Eigen::Vector2d step(layout_.width_mm / 1000 + kGapM, layout_.height_mm / 1000 + kGapM);
  for (int i = 0; i < count; ++i) {
    const int row = i / columns, column = i % columns;
    PutDown(i, {(column - (columns - 1) / 2.0) * step.x(), ((rows - 1) / 2.0 - row) * step.y()}, 0);
  }
}

void Floor::PlaceAnywhere() {
  SeededRandom random(MixSeed(options_.seed, 1));
  // Sheets at any angle are apart if their circles are: they are drawn in a disc that grows until
  // there is room.
  const double apart_m = std::hypot(layout_.width_mm, layout_.height_mm) / 1000 * 0.86 + kGapM;
  double reach_m = 0.2;
  for (uint32_t i = 0; i < layout_.sheets.size(); ++i) {
    for (bool is_placed = false; !is_placed; reach_m *= 1.01) {
      const double distance_m = reach_m * std::sqrt(random.Unit()),
                   angle = 2 * std::numbers::pi * random.Unit();
      const Eigen::Vector2d center_m(distance_m * std::cos(angle), distance_m * std::sin(angle));
      is_placed = std::all_of(sheets_.begin(), sheets_.end(), [&](const PlacedSheet& other) {
        return (other.center_m - center_m).norm() >= apart_m;
      });
      if (is_placed) PutDown(i, center_m, 2 * std::numbers::pi * random.Unit());
    }
  }
}

void Floor::ListMarkers() {
  for (const PlacedSheet& sheet : sheets_) {
    for (const SheetMarker& marker : layout_.sheets[sheet.index].markers) {
      const Eigen::Vector2d paper_mm(marker.x_mm, marker.y_mm), place_m = OnFloor(sheet, paper_mm);
      markers_.push_back({marker.id,
                          layout_.radius_mm / 1000,
                          {place_m.x(), place_m.y(), Height(sheet, paper_mm)}});
    }
  }
  std::sort(markers_.begin(), markers_.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
}

void Floor::ThrowCovers(uint32_t count) {
  SeededRandom random(MixSeed(options_.seed, 2));
  for (uint32_t i = 0; i < count; ++i) {
    Cover cover;
    cover.center_m = extent_m_ * Eigen::Vector2d(2 * random.Unit() - 1, 2 * random.Unit() - 1);
    cover.half_m = {0.01 + 0.08 * random.Unit(), 0.005 + 0.03 * random.Unit()};
    cover.angle_rad = 2 * std::numbers::pi * random.Unit();
    cover.reflectance =
        random.Below(2) == 0 ? 0.03 + 0.1 * random.Unit() : 0.5 + 0.4 * random.Unit();
    cover.is_ellipse = random.Below(2) == 0;
    covers_.push_back(cover);
  }
}

void Floor::FillGrid() {
  grid_side_ = 2 * static_cast<int>(std::ceil(extent_m_ / kCellM)) + 2;
  grid_.assign(static_cast<size_t>(grid_side_) * grid_side_, {});
  const double reach_m = std::hypot(layout_.width_mm, layout_.height_mm) / 2000 + kCellM;
  for (size_t k = 0; k < grid_.size(); ++k) {
    const Eigen::Vector2d cell_m(static_cast<double>(k % grid_side_) + 0.5 - grid_side_ / 2,
                                 static_cast<double>(k / grid_side_) + 0.5 - grid_side_ / 2);
    for (size_t i = 0; i < sheets_.size(); ++i) {
      if ((cell_m * kCellM - sheets_[i].center_m).norm() < reach_m)
        grid_[k].push_back(static_cast<uint16_t>(i));
    }
  }
}

int Floor::SheetAt(const Eigen::Vector2d& place_m) const {
  if (!(place_m.cwiseAbs().maxCoeff() < extent_m_)) return -1;
  const int i = static_cast<int>(std::floor(place_m.x() / kCellM)) + grid_side_ / 2;
  const int j = static_cast<int>(std::floor(place_m.y() / kCellM)) + grid_side_ / 2;
  for (const uint16_t index : grid_[static_cast<size_t>(j) * grid_side_ + i]) {
    const Eigen::Vector2d paper_mm = OnPaper(sheets_[index], place_m);
    if (paper_mm.x() >= 0 && paper_mm.y() >= 0 && paper_mm.x() < layout_.width_mm &&
        paper_mm.y() < layout_.height_mm) {
      return index;
    }
  }
  return -1;
}

Eigen::Vector2d Floor::OnPaper(const PlacedSheet& sheet, const Eigen::Vector2d& place_m) const {
  const Eigen::Vector2d d = 1000 * (place_m - sheet.center_m);
  return {layout_.width_mm / 2 + sheet.cosine * d.x() + sheet.sine * d.y(),
          layout_.height_mm / 2 + sheet.sine * d.x() - sheet.cosine * d.y()};
}

Eigen::Vector2d Floor::OnFloor(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const {
  const double x = paper_mm.x() - layout_.width_mm / 2, y = layout_.height_mm / 2 - paper_mm.y();
  return sheet.center_m +
         Eigen::Vector2d(sheet.cosine * x - sheet.sine * y, sheet.sine * x + sheet.cosine * y) /
             1000;
}

double Floor::Height(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const {
  const Eigen::Vector2d half_mm(layout_.width_mm / 2, layout_.height_mm / 2);
  const double along = (paper_mm - half_mm).dot(sheet.bend_axis) / half_mm.norm();
  return sheet.bend_m * along * along;
}

float Floor::PaperReflectance(const PlacedSheet& sheet, const Eigen::Vector2d& paper_mm) const {
  for (const SheetMarker& marker : layout_.sheets[sheet.index].markers) {
    const double x = (paper_mm.x() - marker.x_mm) / layout_.radius_mm;
    const double y = (paper_mm.y() - marker.y_mm) / layout_.radius_mm;
    if (std::abs(x) <= 1 && std::abs(y) <= 1) return IsMarkerDark(marker.id, x, y) ? kInk : kPaper;
  }
  return kPaper;
}

bool Floor::IsCovered(const Eigen::Vector2d& place_m) const {
  return std::any_of(covers_.begin(), covers_.end(),
                     [&](const Cover& cover) { return IsUnder(cover, place_m); });
}

float Floor::Reflectance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  if (!(direction.z() < -1e-6 * direction.norm())) return kWall;
  const auto hit = [&](double height_m) -> Eigen::Vector2d {
    return (origin + direction * ((height_m - origin.z()) / direction.z())).head<2>();
  };
  Eigen::Vector2d place_m = hit(0);
  for (auto cover = covers_.rbegin(); cover != covers_.rend(); ++cover) {
    if (IsUnder(*cover, place_m)) return static_cast<float>(cover->reflectance);
  }
  const int index = SheetAt(place_m);
  if (index < 0) return FlooringReflectance(options_.flooring, place_m, options_.seed);
  const PlacedSheet& sheet = sheets_[static_cast<size_t>(index)];
  // The surface is nearly flat: each step towards it leaves its slope (under 0.05) times the last
  // error.
  for (int i = 0; i < 4 && sheet.bend_m > 0; ++i)
    place_m = hit(Height(sheet, OnPaper(sheet, place_m)));
  return PaperReflectance(sheet, OnPaper(sheet, place_m));
}

}  // namespace veduta::floor
