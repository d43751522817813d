// SPDX-License-Identifier: Apache-2.0
// Goal: the report holds what it promises, fetches nothing, and nothing that a photo's name
// smuggles
//   in; its figures show what is missing.
// Method: the report and the figures of a session of known truth, with a name that would be a
//   script, with a warning added, and with half of the photo empty.
#include "engine/camera/files/calibration_report.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/camera/files/calibration_figures.h"
#include "tests/engine/camera/files/sample_calibration.h"

namespace veduta {
namespace {

using testing::SampleCalibration;

TEST(Report, HoldsWhatItPromises) {
  const std::string report = CalibrationReport(SampleCalibration(), "my <points>.json");
  for (const char* words :
       {"Coverage", "Residuals", "Distortion", "Photos", "standard deviation", "<td>k2</td>",
        "my &lt;points&gt;.json", "&lt;script&gt;&quot;&amp;.jpg"}) {
    EXPECT_NE(report.find(words), std::string::npos) << words;
  }
  EXPECT_EQ(report.find("<script"), std::string::npos);
  EXPECT_EQ(report.find("http"), report.find("http://www.w3.org/2000/svg"));  // nothing is fetched
  EXPECT_EQ(report.find("nan"), std::string::npos);
  size_t figures = 0;
  for (size_t at = report.find("<svg"); at != std::string::npos; at = report.find("<svg", at + 1))
    ++figures;
  EXPECT_EQ(figures, 4u);
  Calibration warned = SampleCalibration();
  warned.status = CalibrationStatus::kUncertain;
  warned.warnings = {{CalibrationAdvice::kFocalLength, "tilt the camera more"}};
  EXPECT_NE(CalibrationReport(warned, "p").find("tilt the camera more"), std::string::npos);
  EXPECT_EQ(CalibrationReport(warned, "p").find("no further photos"), std::string::npos);
}

TEST(Report, CoverageShowsEmptyCells) {
  Calibration half = SampleCalibration();
  std::erase_if(half.residuals, [](const CalibrationResidual& r) { return r.px.x() > 1136; });
  const auto count = [](const std::string& text) {
    size_t found = 0;
    for (size_t at = text.find("#fde8e4"); at != std::string::npos;
         at = text.find("#fde8e4", at + 1))
      ++found;
    return found;
  };
  EXPECT_GE(count(CoverageFigure(half)), 24u);
  EXPECT_LT(count(CoverageFigure(SampleCalibration())), 24u);
}

TEST(Figures, TextIsEscapedAndNumbersAreFinite) {
  EXPECT_EQ(Escaped("a<b> & \"c\"\n"), "a&lt;b&gt; &amp; &quot;c&quot; ");
  EXPECT_EQ(Fixed(1.25, 1), "1.2");
  EXPECT_EQ(Fixed(-3, 2), "-3.00");
  EXPECT_EQ(Fixed(1.0 / 0.0, 1), "0.0");
}

TEST(Figures, MagnificationsAreRoundNumbersThatMakeTheArrowsVisible) {
  double residuals = 0, distortion = 0;
  EXPECT_NE(ResidualFigure(SampleCalibration(), &residuals).find("<svg"), std::string::npos);
  EXPECT_NE(DistortionFigure(SampleCalibration(), &distortion).find("<svg"), std::string::npos);
  for (double times : {residuals, distortion}) {
    ASSERT_GT(times, 0);
    while (times >= 9.99) times /= 10;
    while (times < 0.999) times *= 10;
    EXPECT_TRUE(std::abs(times - 1) < 1e-6 || std::abs(times - 2) < 1e-6 ||
                std::abs(times - 5) < 1e-6)
        << times;
  }
  // The usual residual is drawn about as long as 1.5 % of the figure's width.
  const double usual = residuals * SampleCalibration().error_px_rms;
  EXPECT_GT(usual, 0.015 / 2.5 * SampleCalibration().model.width_px);
  EXPECT_LT(usual, 0.015 * 2.5 * SampleCalibration().model.width_px);
}

}  // namespace
}  // namespace veduta
