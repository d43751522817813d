// SPDX-License-Identifier: Apache-2.0
#pragma once
// The sheets as a document to print.

#include <cstdint>
#include <vector>

#include "engine/camera/markers/sheet_layout.h"

namespace veduta {

// A PDF of vector drawings with one page for each sheet. Beside each marker stand the number of its
// sheet and its own; below them stands what to do. The same layout gives the same bytes. Arcs are
// Bezier curves that leave the circle by less than 1e-4 of the radius. kIoError, with libharu's
// number of the error, if libharu fails.
Result<std::vector<uint8_t>> SheetPdf(const SheetLayout& layout);

}  // namespace veduta
