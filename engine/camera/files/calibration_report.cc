// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/files/calibration_report.h"

#include <array>

#include "engine/camera/calibration/calibration_advice.h"
#include "engine/camera/files/calibration_figures.h"

namespace veduta {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Calibration report</title><style>
body { font-family: sans-serif; color: #1f2933; max-width: 680px; margin: 2em auto;
padding: 0 1em; line-height: 1.4 }
h1 { font-size: 1.5em } h2 { font-size: 1.1em; margin-top: 2em }
svg { max-width: 100%; height: auto } table { border-collapse: collapse }
td, th { padding: 0.2em 1em 0.2em 0; text-align: right } th { font-weight: normal }
td:first-child, th:first-child { text-align: left } tr { border-bottom: 1px solid #e4e7eb }
.warning { border-left: 4px solid #c0392b; padding-left: 0.8em }
.note { border-left: 4px solid #9aa5b1; padding-left: 0.8em }
.good { border-left: 4px solid #2d8653; padding-left: 0.8em }
p.caption { color: #52606d; font-size: 0.9em }
</style></head><body>
)";

std::string Paragraph(const std::string& kind, const std::string& text) {
  return "<p class=\"" + kind + "\">" + Escaped(text) + "</p>\n";
}

std::string Section(const std::string& title, const std::string& caption,
                    const std::string& content) {
  return "<h2>" + title + "</h2>\n" + content +
         (caption.empty() ? "" : Paragraph("caption", caption));
}

std::string AdviceOf(const Calibration& c) {
  std::string advice;
  for (const CalibrationWarning& w : c.warnings)
    advice += Paragraph(w.IsNote() ? "note" : "warning", w.text);
  if (c.status == CalibrationStatus::kGood) {
    advice =
        Paragraph("good",
                  "Good: every parameter is known well enough; no further photos are needed.") +
        advice;
  }
  return advice;
}

std::string ParametersOf(const Calibration& c) {
  constexpr std::array<const char*, 8> kMeaning = {"focal length, px",
                                                   "focal length, vertical, px",
                                                   "principal point, x, px",
                                                   "principal point, y, px",
                                                   "distortion, r^2",
                                                   "distortion, r^4",
                                                   "centre of distortion, x, px",
                                                   "centre of distortion, y, px"};
  std::string rows =
      "<tr><th></th><th>value</th><th>standard deviation</th><th>meaning</th></tr>\n";
  const std::array<double, 8> values = IntrinsicsOf(c.model);
  for (size_t i = 0; i < values.size(); ++i) {
    const int digits = i == 4 || i == 5 ? 5 : 2;
    rows += std::string("<tr><td>") + kIntrinsicNames[i] + "</td><td>" + Fixed(values[i], digits) +
            "</td><td>" + Fixed(c.Sigma(static_cast<int>(i)), digits) + "</td><td>" + kMeaning[i] +
            "</td></tr>\n";
  }
  return "<table>" + rows + "</table>\n";
}

std::string SummaryOf(const Calibration& c, const std::string& from) {
  return "From " + from + ": " + std::to_string(c.UsedPhotoCount()) + " of " +
         std::to_string(c.photos.size()) + " photos of " +
         ImageSize{c.model.width_px, c.model.height_px}.Text() + " px. Mean reprojection error " +
         Fixed(c.error_px_mean, 3) + " px. The focal length is known to " +
         Fixed(100 * c.Sigma(0) / c.model.fx, 3) + " %, the distortion to " +
         Fixed(c.distortion_sigma_px, 2) + " px all over the photo.";
}

std::string PixelsOf(const Calibration& c) {
  if (c.is_aspect_free) {
    return "fy was set free: the photos prove that it differs from fx (by " +
           Fixed(c.aspect_sigmas, 0) + " standard deviations).";
  }
  return "fy = fx: set free, their ratio would differ from 1 by " + Fixed(c.aspect_sigmas, 1) +
         " of its standard deviations, which proves nothing or changes less than a thousandth.";
}

}  // namespace

std::string CalibrationReport(const Calibration& c, const std::string& from) {
  double residual_times = 1, distortion_times = 1;
  const std::string residuals = ResidualFigure(c, &residual_times);
  const std::string distortion = DistortionFigure(c, &distortion_times);
  return kHead + std::string("<h1>Calibration report</h1>\n") +
         Paragraph("summary", SummaryOf(c, from)) + AdviceOf(c) +
         Section("Parameters", PixelsOf(c), ParametersOf(c)) +
         Section("Coverage",
                 "Where points were seen in the photos: dots were used, crosses left out. " +
                     Fixed(100 * CoveredShare(c), 0) +
                     " % of the cells have points; reddish ones have none.",
                 CoverageFigure(c)) +
         Section("Residuals",
                 "From where a point was seen towards where the model expects it, enlarged " +
                     Fixed(residual_times, 0) +
                     " times. Arrows that agree with their neighbours are what the model cannot "
                     "express.",
                 residuals) +
         Section(
             "Distortion",
             "From where the lens shows a point away from where a pinhole camera would, enlarged " +
                 Fixed(distortion_times, distortion_times < 1 ? 1 : 0) +
                 " times. Cross: principal point; circle: centre of distortion.",
             distortion) +
         Section("Photos", "RMS reprojection error, points used, tilt against the upright view.",
                 PhotoErrorFigure(c)) +
         "</body></html>\n";
}

}  // namespace veduta
