// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/sheet_pdf.h"

#include <hpdf.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "engine/camera/markers/marker_pattern.h"

namespace veduta {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;

struct FreeDocument {
  void operator()(HPDF_Doc document) const { HPDF_Free(document); }
};
using Document = std::unique_ptr<std::remove_pointer_t<HPDF_Doc>, FreeDocument>;

// Draws in millimetres from the paper's upper left corner.
class Page final {
 public:
  Page(HPDF_Page page, const SheetLayout& layout) : page_(page), height_mm_(layout.height_mm) {
    HPDF_Page_SetWidth(page_, X(layout.width_mm));
    HPDF_Page_SetHeight(page_, static_cast<HPDF_REAL>(layout.height_mm * kPointsPerMm));
  }

  void Marker(const SheetMarker& marker, double radius_mm) {
    BeginAt(marker, radius_mm);
    // Some viewers show hair lines between two paths that touch, so each run of dark sectors is one
    // path.
    FillRing(kMarkerCodeRadius, 1, 0, kMarkerBitCount);
    const uint32_t word = MarkerWord(marker.id);
    for (int first = 0; first < kMarkerBitCount; ++first) {
      const bool starts = IsDark(word, first) && !IsDark(word, first + kMarkerBitCount - 1);
      if (!starts) continue;
      int end = first + 1;
      while (IsDark(word, end)) ++end;
      // Reaches into the dark ring, which it touches anyway.
      FillRing(kMarkerBoardRadius, (1 + kMarkerCodeRadius) / 2, first, end);
    }
    for (const double quadrant : {0.0, 2.0}) {
      MoveTo(0, 0);
      LineTo(kMarkerBoardRadius, quadrant / 4);
      ArcTo(kMarkerBoardRadius, quadrant / 4, (quadrant + 1) / 4);
      HPDF_Page_ClosePath(page_);
      HPDF_Page_Fill(page_);
    }
  }

  // `x_mm`, `y_mm`: where the first letter's base line begins.
  void Text(double x_mm, double y_mm, HPDF_Font font, double size_points, const std::string& text) {
    HPDF_Page_SetFontAndSize(page_, font, static_cast<HPDF_REAL>(size_points));
    HPDF_Page_BeginText(page_);
    HPDF_Page_TextOut(page_, X(x_mm), Y(y_mm), text.c_str());
    HPDF_Page_EndText(page_);
  }

 private:
  static bool IsDark(uint32_t word, int sector) {
    return (word >> (sector % kMarkerBitCount) & 1) == 0;
  }
  HPDF_REAL X(double x_mm) const { return static_cast<HPDF_REAL>(x_mm * kPointsPerMm); }
  HPDF_REAL Y(double y_mm) const {
    return static_cast<HPDF_REAL>((height_mm_ - y_mm) * kPointsPerMm);
  }
  void BeginAt(const SheetMarker& marker, double radius_mm) {
    x_mm_ = marker.x_mm;
    y_mm_ = marker.y_mm;
    radius_mm_ = radius_mm;
  }

  // Places of the marker's frame, polar: radius, and turns from the x axis towards the y axis.
  HPDF_REAL MarkerX(double radius, double turn) const {
    return X(x_mm_ + radius_mm_ * radius * std::cos(2 * std::numbers::pi * turn));
  }
  HPDF_REAL MarkerY(double radius, double turn) const {
    return Y(y_mm_ + radius_mm_ * radius * std::sin(2 * std::numbers::pi * turn));
  }
  void MoveTo(double radius, double turn) {
    HPDF_Page_MoveTo(page_, MarkerX(radius, turn), MarkerY(radius, turn));
  }
  void LineTo(double radius, double turn) {
    HPDF_Page_LineTo(page_, MarkerX(radius, turn), MarkerY(radius, turn));
  }

  // Along the circle from one turn to another, either way, in pieces of at most 1/23 of a turn.
  // Each piece is a cubic whose handles are 4/3 tan(angle / 4) of the radius long, the usual
  // approximation of an arc.
  void ArcTo(double radius, double from, double to) {
    const int pieces = static_cast<int>(std::ceil(std::abs(to - from) * kMarkerBitCount - 1e-9));
    const double step = (to - from) / pieces;
    const double handle = 4.0 / 3 * std::tan(2 * std::numbers::pi * step / 4);
    const double handle_radius = radius * std::hypot(1, handle);
    const double handle_turn = std::atan(handle) / (2 * std::numbers::pi);
    for (int i = 0; i < pieces; ++i) {
      const double a = from + i * step, b = a + step;
      HPDF_Page_CurveTo(
          page_, MarkerX(handle_radius, a + handle_turn), MarkerY(handle_radius, a + handle_turn),
          MarkerX(handle_radius, b - handle_turn), MarkerY(handle_radius, b - handle_turn),
          MarkerX(radius, b), MarkerY(radius, b));
    }
  }

  // Ink between two radii, from the start of sector `first` to the start of sector `end`. 23
  // sectors make the whole ring.
  void FillRing(double inner, double outer, int first, int end) {
    const double from = static_cast<double>(first) / kMarkerBitCount,
                 to = static_cast<double>(end) / kMarkerBitCount;
    MoveTo(outer, from);
    ArcTo(outer, from, to);
    const bool is_whole = end - first == kMarkerBitCount;
    if (is_whole) {
      HPDF_Page_ClosePath(page_);
      MoveTo(inner, to);
    } else {
      LineTo(inner, to);
    }
    ArcTo(inner, to, from);
    HPDF_Page_ClosePath(page_);
    HPDF_Page_Eofill(page_);
  }

  HPDF_Page page_;
  double height_mm_;
  double x_mm_ = 0, y_mm_ = 0, radius_mm_ = 1;
};

void DrawSheet(const SheetLayout& layout, const Sheet& sheet, HPDF_Font font, Page* page) {
  const double quiet_mm = kMarkerQuietRadius * layout.radius_mm;
  for (const SheetMarker& marker : sheet.markers) {
    page->Marker(marker, layout.radius_mm);
    // The corner between the circles is free, for the quiet zone is round.
    page->Text(marker.x_mm - quiet_mm, marker.y_mm + quiet_mm - 1, font, 7,
               "sheet " + std::to_string(sheet.number) + " id " + std::to_string(marker.id));
  }
  const double foot_mm = layout.height_mm - layout.margin_mm;
  page->Text(layout.margin_mm, foot_mm - 7, font, 8,
             "Veduta calibration sheet " + std::to_string(sheet.number) + " of " +
                 std::to_string(layout.sheets.size()) +
                 ". Print in black, any scale, and tape all sheets flat on one "
                 "floor, anywhere, and do not move them.");
  page->Text(layout.margin_mm, foot_mm - 3, font, 8,
             "Take 8 to 20 sharp photos without zoom from all sides, some steep, some slanted, "
             "markers up to every "
             "corner; then: veduta calibrate PHOTOS");
}

}  // namespace

Result<std::vector<uint8_t>> SheetPdf(const SheetLayout& layout) {
  // Without an error handler libharu keeps its first error in the document and does nothing more.
  const Document document(HPDF_New(nullptr, nullptr));
  if (document == nullptr) return Status::IoError("libharu cannot begin a PDF: not enough memory");
  HPDF_SetCompressionMode(document.get(), HPDF_COMP_ALL);
  HPDF_Font font = HPDF_GetFont(document.get(), "Helvetica", nullptr);
  for (const Sheet& sheet : layout.sheets) {
    Page page(HPDF_AddPage(document.get()), layout);
    DrawSheet(layout, sheet, font, &page);
  }
  HPDF_SaveToStream(document.get());
  std::vector<uint8_t> bytes(HPDF_GetStreamSize(document.get()));
  auto size = static_cast<HPDF_UINT32>(bytes.size());
  HPDF_ReadFromStream(document.get(), bytes.data(), &size);
  if (const HPDF_STATUS error = HPDF_GetError(document.get());
      error != HPDF_OK || size != bytes.size()) {
    return Status::IoError("libharu cannot write the PDF: its error " + std::to_string(error));
  }
  return bytes;
}

}  // namespace veduta
