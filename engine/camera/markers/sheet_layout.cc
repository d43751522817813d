// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/sheet_layout.h"

#include <algorithm>
#include <string>

#include "engine/camera/markers/marker_pattern.h"

namespace veduta {
namespace {

constexpr int kColumns = 2, kRows = 3;
static_assert(kColumns * kRows == kMarkersPerSheet);
constexpr double kMarginMm = 10;  // most printers leave 4 to 6 mm white; chosen by hand
constexpr double kFootMm = 14;    // for the lines of text below the markers

}  // namespace

std::optional<Paper> PaperFromName(std::string_view name) {
  if (name == "a4") return Paper::kA4;
  if (name == "letter") return Paper::kLetter;
  return std::nullopt;
}

Result<SheetLayout> LayOutSheets(Paper paper, uint32_t count) {
  if (count < 1 || count > kMarkerIdCount) {
    return Status::InvalidArgument("there are 1 to " + std::to_string(kMarkerIdCount) +
                                   " markers, not " + std::to_string(count));
  }
  SheetLayout layout;
  layout.width_mm = paper == Paper::kA4 ? 210 : 215.9;
  layout.height_mm = paper == Paper::kA4 ? 297 : 279.4;
  layout.margin_mm = kMarginMm;
  const double cell_width_mm = (layout.width_mm - 2 * kMarginMm) / kColumns;
  const double cell_height_mm = (layout.height_mm - 2 * kMarginMm - kFootMm) / kRows;
  layout.radius_mm = std::min(cell_width_mm, cell_height_mm) / 2 / kMarkerQuietRadius;
  for (MarkerId id = 0; id < count; ++id) {
    const uint32_t place = id % kMarkersPerSheet;
    if (place == 0) layout.sheets.push_back({id / kMarkersPerSheet + 1, {}});
    layout.sheets.back().markers.push_back({id,
                                            kMarginMm + (place % kColumns + 0.5) * cell_width_mm,
                                            kMarginMm + (place / kColumns + 0.5) * cell_height_mm});
  }
  return layout;
}

}  // namespace veduta
