// SPDX-License-Identifier: Apache-2.0
// Goal: every marker asked for is printed once, whole and apart from its neighbours, on a PDF
//   that says which is which.
// Method: the layout's circles against each other and the paper's edges; the pattern sector by
//   sector against the code; the PDF's structure, and its bytes made twice.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include "engine/camera/markers/marker_pattern.h"
#include "engine/camera/markers/sheet_pdf.h"

namespace veduta {
namespace {

TEST(SheetLayout, KeepsEveryQuietZoneOnThePaperAndFree) {
  for (const Paper paper : {Paper::kA4, Paper::kLetter}) {
    const SheetLayout layout = LayOutSheets(paper, 100).value();
    ASSERT_EQ(layout.sheets.size(), 17u);
    EXPECT_EQ(layout.sheets.back().markers.size(), 4u);
    EXPECT_GT(layout.radius_mm, 30);
    const double quiet_mm = layout.radius_mm * kMarkerQuietRadius - 1e-9;
    std::set<MarkerId> ids;
    for (const Sheet& sheet : layout.sheets) {
      for (const SheetMarker& a : sheet.markers) {
        EXPECT_TRUE(ids.insert(a.id).second);
        EXPECT_GE(std::min(a.x_mm, layout.width_mm - a.x_mm), layout.margin_mm + quiet_mm);
        EXPECT_GE(std::min(a.y_mm, layout.height_mm - a.y_mm), layout.margin_mm + quiet_mm);
        for (const SheetMarker& b : sheet.markers) {
          if (a.id == b.id) continue;
          EXPECT_GE(std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm), 2 * quiet_mm);
        }
      }
    }
    EXPECT_EQ(ids.size(), 100u);
    EXPECT_EQ(*ids.rbegin(), 99u);
  }
}

TEST(SheetLayout, RefusesWhatTheCodeCannotHold) {
  EXPECT_EQ(LayOutSheets(Paper::kA4, 0).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(LayOutSheets(Paper::kA4, kMarkerIdCount + 1).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_TRUE(LayOutSheets(Paper::kLetter, kMarkerIdCount).ok());
  EXPECT_FALSE(PaperFromName("A5"));
}

TEST(MarkerPattern, ShowsItsWordAndItsCorner) {
  for (const MarkerId id : {0u, 57u, kMarkerIdCount - 1}) {
    for (int i = 0; i < kMarkerBitCount; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5) / kMarkerBitCount;
      const auto is_dark_at = [&](double r) {
        return IsMarkerDark(id, r * std::cos(angle), r * std::sin(angle));
      };
      EXPECT_EQ(is_dark_at(0.7), (MarkerWord(id) >> i & 1) == 0);
      EXPECT_TRUE(is_dark_at(0.9));
      EXPECT_FALSE(is_dark_at(1.1));
    }
    EXPECT_TRUE(IsMarkerDark(id, 0.1, 0.1) && IsMarkerDark(id, -0.1, -0.1));
    EXPECT_FALSE(IsMarkerDark(id, -0.1, 0.1) || IsMarkerDark(id, 0.1, -0.1));
  }
}

TEST(SheetPdf, IsADocumentOfAllSheetsAndTheSameEachTime) {
  const SheetLayout layout = LayOutSheets(Paper::kA4, 96).value();
  const std::vector<uint8_t> bytes = SheetPdf(layout).value();
  const std::string text(bytes.begin(), bytes.end());
  EXPECT_TRUE(text.starts_with("%PDF-1."));
  EXPECT_NE(text.find("%%EOF"), std::string::npos);
  EXPECT_NE(text.find("/Count 16"), std::string::npos);
  EXPECT_EQ(text.find("/Subtype /Image"), std::string::npos) << "vectors only";
  EXPECT_LT(bytes.size(), 1u << 20);
  EXPECT_EQ(SheetPdf(layout).value(), bytes);
}

}  // namespace
}  // namespace veduta
