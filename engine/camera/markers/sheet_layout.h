// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which marker is printed where: sheets of two columns and three rows.

#include <optional>
#include <string_view>
#include <vector>

#include "engine/camera/markers/marker_code.h"
#include "storage/base/status.h"

namespace veduta {

enum class Paper : uint8_t { kA4, kLetter };

inline constexpr uint32_t kMarkersPerSheet = 6;

// Millimetres on the paper, from its upper left corner, x right, y down.
struct SheetMarker {
  MarkerId id = 0;
  double x_mm = 0, y_mm = 0;  // of the feature point
};

struct Sheet {
  uint32_t number = 0;  // counted from 1
  std::vector<SheetMarker> markers;
};

struct SheetLayout {
  double width_mm = 0, height_mm = 0;  // of the paper
  double margin_mm = 0;                // what printers cannot print on, at each side
  double radius_mm = 0;                // of every marker's dark ring
  std::vector<Sheet> sheets;
};

std::optional<Paper> PaperFromName(std::string_view name);  // "a4" or "letter"

// Markers 0 to count - 1, six on each sheet; the last sheet may have fewer. kInvalidArgument unless
// count is in [1, kMarkerIdCount].
Result<SheetLayout> LayOutSheets(Paper paper, uint32_t count);

}  // namespace veduta
