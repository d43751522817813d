// SPDX-License-Identifier: Apache-2.0
#pragma once
// The sheets as a document to print.

#include <cstdint>
#include <vector>

#include "engine/camera/markers/sheet_layout.h"

namespace veduta {

// A PDF of vectors, a page a sheet: markers, each with the numbers of its sheet and its own beside
// it, and a line that says what to do. The same bytes for the same layout. A marker's edges are
// exact: arcs are Bezier curves that leave the circle by less than 1e-4 of the radius. kIoError if
// libharu fails, with its number.
Result<std::vector<uint8_t>> SheetPdf(const SheetLayout& layout);

}  // namespace veduta
